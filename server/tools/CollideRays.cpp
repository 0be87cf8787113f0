#include "server/tools/CollideRays.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/rays/IntersectAction.h"
#include "server/tools/SceneImport.h"

namespace tessera {
namespace {

std::string answerLine(const std::optional<Intersection>& hit, const Aspect& scene, AnswerFormat format) {
    const bool asJson = format == AnswerFormat::kJson;
    if (!hit) return asJson ? R"({"hit":false})" : "meets nothing";
    const std::string path = pathOf(scene, hit->node);
    const auto words = [&](const Vec3d& v) {
        return asJson ? fmt::format("[{:.17g},{:.17g},{:.17g}]", v.x(), v.y(), v.z())
                      : fmt::format("({:.9g} {:.9g} {:.9g})", v.x(), v.y(), v.z());
    };
    if (!asJson)
        return fmt::format("{} at t = {:.9g}, face {}, point {}, normal {}", path, hit->t, hit->face, words(hit->point),
                           words(hit->normal));
    const std::string quoted = nlohmann::json(path).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return fmt::format(R"({{"hit":true,"node":{},"t":{:.17g},"face":{},"point":{},"normal":{}}})", quoted, hit->t,
                       hit->face, words(hit->point), words(hit->normal));
}

}  // namespace

Expected<void> collideRays(const CollideArguments& arguments) {
    const Expected<std::vector<RayLine>> rays = readRays(arguments.poses);
    if (!rays) return tl::unexpected(rays.error());
    const Expected<FileScene> file =
        importAsScene(arguments.a, {.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined});
    if (!file) return tl::unexpected(file.error());
    for (const std::string& note : file->imported.notes)
        fmt::print(stderr, "tessera-collide: {}{}\n", note.starts_with(arguments.a) ? "" : arguments.a + ": ", note);
    IntersectAction action;
    action.lookAnew(file->scene);
    for (const RayLine& line : *rays) {
        const Expected<std::optional<Intersection>> hit = action.nearest(file->scene, line.ray);
        if (!hit)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: {}", arguments.poses, line.line, hit.error().message));
        fmt::print("{}\n", answerLine(*hit, file->scene, arguments.format));
    }
    if (std::fflush(stdout) != 0) return fail(ErrorCode::kFailed, "the answers cannot be written to stdout");
    return {};
}

}  // namespace tessera
