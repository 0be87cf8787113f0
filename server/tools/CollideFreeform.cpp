#include "server/tools/CollideFreeform.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "common/freeform/nurbs/ObjSurfaces.h"
#include "server/tools/SceneTriangles.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

std::string inJson(const Vec3d& v) { return fmt::format("[{:.17g},{:.17g},{:.17g}]", v.x(), v.y(), v.z()); }
std::string inWords(const Vec3d& v) { return fmt::format("({:.9g} {:.9g} {:.9g})", v.x(), v.y(), v.z()); }
std::string faceInJson(const FreeformPlace& p) { return p.face == kNoIndex ? "null" : fmt::format("{}", p.face); }
std::string faceInWords(const FreeformPlace& p) { return p.face == kNoIndex ? "whole" : fmt::format("{}", p.face); }

/// `"faces":[a,b],"uv":[[…],[…]],"points":[[…],[…]]`.
std::string placesInJson(const FreeformPlace& a, const FreeformPlace& b) {
    return fmt::format(R"("faces":[{},{}],"uv":[[{:.17g},{:.17g}],[{:.17g},{:.17g}]],"points":[{},{}])", faceInJson(a), faceInJson(b), a.u, a.v, b.u, b.v, inJson(a.point),
                       inJson(b.point));
}
std::string placesInWords(const FreeformPlace& a, const FreeformPlace& b) {
    return fmt::format("face {} at {:.6g} {:.6g} {}, face {} at {:.6g} {:.6g} {}", faceInWords(a), a.u, a.v, inWords(a.point), faceInWords(b), b.u, b.v, inWords(b.point));
}

std::string unsure(bool complete, bool json) { return complete ? "" : json ? R"(,"complete":false)" : "; gave up before it was sure"; }

std::string contactsLine(const FreeformContacts& found, double tolerance, bool json) {
    const bool hit = !found.contacts.empty() || !found.complete;
    if (!json) {
        std::string line = fmt::format("{} contacts{}", found.contacts.size(), found.contacts.empty() ? "" : ":");
        for (std::size_t i = 0; i < std::min(found.contacts.size(), kPairsNamed); ++i) line += " " + placesInWords(found.contacts[i].a, found.contacts[i].b) + ";";
        return line + unsure(found.complete, json);
    }
    std::string list;
    for (const FreeformContact& c : found.contacts) {
        list += fmt::format(R"({}{{{},"point":{},"normal":{}}})", list.empty() ? "" : ",", placesInJson(c.a, c.b), inJson(c.point), inJson(c.normal));
    }
    return fmt::format(R"({{"hit":{},"contacts":[{}],"error":{:.17g}{}}})", hit, list, tolerance, unsure(found.complete, json));
}

}  // namespace

Expected<FreeformShape> loadFreeform(const std::string& path, const std::optional<FreeformKind>& kind, Representation otherwise, const CollideArguments& arguments) {
    const auto named = [&](Expected<FreeformShape> shape) -> Expected<FreeformShape> {
        if (!shape) return failWith(path, shape.error());
        return shape;
    };
    if (!kind) {
        Expected<TriangleMesh> mesh = readTriangles(path, {.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined});
        if (!mesh) return tl::unexpected(mesh.error());
        if (otherwise != Representation::kHull) return named(FreeformShape::ofTriangles(std::move(*mesh)));
        Expected<ConvexHull> hull = ConvexHull::make(*mesh);
        if (!hull) return failWith(path, hull.error());
        return named(FreeformShape::ofHull(std::move(*hull)));
    }
    const Expected<std::string> text = readSurfaceText(path);
    if (!text) return tl::unexpected(text.error());
    if (*kind == FreeformKind::kNurbs) {
        Expected<std::vector<NurbsSurface>> surfaces = readNurbsObj(*text, path);
        if (!surfaces) return tl::unexpected(surfaces.error());
        return named(FreeformShape::ofNurbs(std::move(*surfaces)));
    }
    const Expected<ObjControlMesh> mesh = parseObjControlMesh(*text, path, *kind == FreeformKind::kLoop ? SubdivisionScheme::kLoop : SubdivisionScheme::kCatmullClark);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const std::string& note : mesh->notes) fmt::print(stderr, "tessera-collide: {}: {}\n", path, note);
    return named(FreeformShape::ofSubdivision(mesh->mesh));
}

std::string freeformAnswer(FreeformPair& pair, const PoseLine& pose, const CollideArguments& arguments, double& us) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    const auto stop = [&] { us = std::chrono::duration<double, std::micro>(Clock::now() - start).count(); };
    const bool json = arguments.format == AnswerFormat::kJson;
    const double tolerance = arguments.tolerance.value_or(kFreeformTolerance);
    const Affine3d a_T_b = pose.start.matrix();
    QueryWork work{.limit = kMostFreeformWork};
    switch (arguments.query) {
        case CollideQuery::kAny: {
            const FreeformTouch touch = pair.touch(a_T_b, tolerance, work);
            stop();
            const bool hit = touch.touch != Touch::kNo, known = touch.touch != Touch::kUnknown;
            if (json) return fmt::format(R"({{"hit":{}{},"error":{:.17g}{}}})", hit, hit && known ? "," + placesInJson(touch.a, touch.b) : "", tolerance, unsure(known, json));
            return (hit ? "touch" + (known ? ": " + placesInWords(touch.a, touch.b) : std::string()) : "do not touch") + unsure(known, json);
        }
        case CollideQuery::kAll: {
            const FreeformContacts found = pair.contacts(a_T_b, work, {.tolerance = tolerance});
            stop();
            return contactsLine(found, tolerance, json);
        }
        case CollideQuery::kImpact: {
            const FreeformImpact hit = pair.firstContact(BodyMotion{}, BodyMotion{pose.start, *pose.end}, tolerance, work);
            stop();
            if (!hit.hit) {
                if (json) return fmt::format(R"({{"hit":{}{}{}}})", !hit.complete, hit.complete ? "" : fmt::format(R"(,"t":{:.17g})", hit.t), unsure(hit.complete, json));
                return (hit.complete ? "they do not touch on the way" : fmt::format("free up to t = {:.9g}", hit.t)) + unsure(hit.complete, json);
            }
            if (json) return fmt::format(R"({{"hit":true,"t":{:.17g},"distance":{:.17g},{},"normal":{}}})", hit.t, hit.distance, placesInJson(hit.a, hit.b), inJson(hit.normal));
            return fmt::format("touch at t = {:.9g}, {:.3g} apart: {}", hit.t, hit.distance, placesInWords(hit.a, hit.b));
        }
        default: {
            const FreeformDistance d = pair.distance(a_T_b, work, {.tolerance = tolerance});
            stop();
            if (json) return fmt::format(R"({{"distance":{:.17g},"least":{:.17g},{},"error":{:.17g}{}}})", d.distance, d.least, placesInJson(d.a, d.b), d.distance - d.least, unsure(d.complete, json));
            return fmt::format("distance {:.9g}, at least {:.9g}: {}{}", d.distance, d.least, placesInWords(d.a, d.b), unsure(d.complete, json));
        }
    }
}

}  // namespace tessera
