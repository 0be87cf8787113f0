#include "server/import/reader/UsdMeshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>

#include "common/geometry/Primitives.h"
#include "common/math/Srgb.h"
#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

/// Vertices at one point that are looked through for an equal one: more are rare, and made for that.
constexpr int kMostVerticesAtPoint = 64;

std::uint8_t colorByte(float share) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(std::isfinite(share) ? share : 0.0F, 0.0F, 1.0F) * 255.0F));
}

/// What all faces and corners name as they stand: of each its first corner.
std::vector<std::uint32_t> usdCounts(const std::optional<UsdAttribute>& attribute) {
    std::vector<std::uint32_t> out;
    if (!attribute || !attribute->value) return out;
    for (const std::int32_t number : attribute->value->numbers<std::int32_t>())
        out.push_back(static_cast<std::uint32_t>(number));  // below 0: far too large
    return out;
}

}  // namespace

struct UsdMeshes::Faces {
    std::vector<float> points;
    std::vector<std::uint32_t> vertices;  ///< of all corners
    std::vector<std::uint32_t> first;     ///< corner of each face, and one more
    std::vector<bool> sound;              ///< can be shown
    bool leftHanded = false;
    std::string scheme;
    bool schemeSaid = false;

    [[nodiscard]] std::size_t count() const { return first.size() - 1; }
    [[nodiscard]] UsdElements elements() const { return {count(), points.size() / 3, vertices.size()}; }
    [[nodiscard]] std::span<const std::uint32_t> corners(std::size_t face) const {
        return std::span(vertices).subspan(first[face], first[face + 1] - first[face]);
    }
    [[nodiscard]] bool areTriangles() const {
        for (std::size_t f = 0; f < count(); ++f)
            if (corners(f).size() != 3) return false;
        return true;
    }
    /// Newell's, as long as twice the face's area.
    [[nodiscard]] Vec3d normal(std::size_t face) const {
        Vec3d sum = Vec3d::Zero();
        const std::span<const std::uint32_t> all = corners(face);
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Vec3d a = point(all[i]), b = point(all[(i + 1) % all.size()]);
            sum += a.cross(b);
        }
        return leftHanded ? Vec3d(-sum) : sum;
    }
    [[nodiscard]] Vec3d point(std::uint32_t vertex) const {
        const float* p = points.data() + std::size_t{3} * vertex;
        return {p[0], p[1], p[2]};
    }
};

Expected<UsdMeshes::Faces> UsdMeshes::facesOf(const UsdComposedPrim& prim) {
    Faces faces;
    const std::optional<UsdAttribute> points = prim.attribute("points");
    if (points && points->value) faces.points = points->value->numbers<float>();
    if (points && points->samples.size() > 1)
        remarks_.add("meshes that change their shape over time are shown as they are first", prim.path());
    faces.points.resize(faces.points.size() / 3 * 3);
    faces.vertices = usdCounts(prim.attribute("faceVertexIndices"));
    faces.first = {0};
    std::size_t corner = 0;
    const std::vector<std::uint32_t> counts = usdCounts(prim.attribute("faceVertexCounts"));
    for (const std::uint32_t count : counts) {
        if (count > faces.vertices.size() - corner) {
            scene_.noteMissing(
                fmt::format("{}: {} of {} faces are left out; the first, number {}, has corners that are "
                            "not there",
                            prim.path(), counts.size() - faces.count(), counts.size(), faces.count()));
            break;
        }
        corner += count;
        faces.first.push_back(static_cast<std::uint32_t>(corner));
    }
    LeftOutParts missing(prim.path(), "faces");
    faces.sound.resize(faces.count());
    for (std::size_t f = 0; f < faces.count(); ++f)
        faces.sound[f] = missing.keeps(faces.corners(f), faces.points.size() / 3, [&](std::uint32_t v) {
            return stands(faces.points.data() + std::size_t{3} * v);
        }) && faces.corners(f).size() >= 3;
    if (!missing.text().empty()) scene_.noteMissing(missing.text());
    for (const std::uint32_t hole : usdCounts(prim.attribute("holeIndices")))
        if (hole < faces.count()) faces.sound[hole] = false;
    faces.leftHanded = usdWord(prim, "orientation", "rightHanded") == "leftHanded";
    const std::optional<UsdAttribute> scheme = prim.attribute("subdivisionScheme");
    faces.schemeSaid = scheme && scheme->value;
    faces.scheme = usdWord(prim, "subdivisionScheme", "catmullClark");
    return faces;
}

Expected<std::vector<std::pair<std::string, std::vector<std::uint32_t>>>> UsdMeshes::groupsOf(
    const UsdComposedPrim& prim, const std::string& material, const Faces& faces) {
    std::vector<std::pair<std::string, std::vector<std::uint32_t>>> groups;
    std::vector<bool> taken(faces.count());
    for (const std::string& name : prim.childNames()) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        if ((*child)->type() != "GeomSubset" || !(*child)->active()) continue;
        if (usdWord(**child, "elementType", "face") != "face") {
            remarks_.add("subsets of other elements than faces are left out", (*child)->path());
            continue;
        }
        std::string bound = usdBoundMaterial(**child);
        if (bound.empty() || worn_.holds) continue;
        std::vector<std::uint32_t> which;
        for (const std::uint32_t face : usdCounts((*child)->attribute("indices")))
            if (face < faces.count() && !taken[face]) {
                taken[face] = true;
                if (faces.sound[face]) which.push_back(face);
            }
        std::ranges::sort(which);
        if (!which.empty()) groups.emplace_back(std::move(bound), std::move(which));
    }
    std::vector<std::uint32_t> others;
    for (std::uint32_t face = 0; face < faces.count(); ++face)
        if (faces.sound[face] && !taken[face]) others.push_back(face);
    if (!others.empty()) groups.emplace_back(material, std::move(others));
    return groups;
}

std::optional<UsdPrimvar> UsdMeshes::normalsOf(const UsdComposedPrim& prim, const Faces& faces) {
    const bool polygons = faces.scheme != "catmullClark" && faces.scheme != "loop";
    if (polygons || !faces.schemeSaid)
        for (const char* name : {"primvars:normals", "normals"})
            if (std::optional<UsdPrimvar> said = UsdPrimvar::of(prim, nullptr, name, 3, faces.elements(), remarks_))
                return said;
    // None are said: polygons are flat, what stands for a smooth surface is smooth.
    std::vector<float> normals((polygons ? faces.count() : faces.points.size() / 3) * 3);
    for (std::size_t f = 0; f < faces.count(); ++f) {
        if (!faces.sound[f]) continue;
        const Vec3f normal = faces.normal(f).cast<float>();
        const auto addTo = [&](std::size_t element) {
            for (std::size_t i = 0; i < 3; ++i) normals[3 * element + i] += normal[static_cast<int>(i)];
        };
        if (polygons)
            addTo(f);
        else
            for (const std::uint32_t vertex : faces.corners(f)) addTo(vertex);
    }
    return UsdPrimvar(std::move(normals), 3, polygons ? UsdPrimvar::Per::kFace : UsdPrimvar::Per::kVertex);
}

MeshData UsdMeshes::meshOf(const UsdComposedPrim& prim, const Faces& faces, const std::vector<std::uint32_t>& which,
                           const UsdLook& look, const std::optional<UsdPrimvar>& normals) {
    const auto primvar = [&](const std::string& name, std::size_t width) {
        return name.empty()
                   ? std::nullopt
                   : UsdPrimvar::of(prim, worn_.primvars, "primvars:" + name, width, faces.elements(), remarks_);
    };
    const std::array<std::optional<UsdPrimvar>, 2> texcoords = {primvar(look.texcoords[0], 2),
                                                                primvar(look.texcoords[1], 2)};
    const std::optional<UsdPrimvar> colors = primvar(look.colors, 3);
    const std::optional<UsdPrimvar> opacities =
        look.colors == "displayColor" ? primvar("displayOpacity", 1) : std::nullopt;
    // Of each vertex what it is made of, so that equal corners at one point are one vertex.
    struct Vertex {
        std::array<float, 7> numbers{};
        std::array<std::uint8_t, 4> color{255, 255, 255, 255};
        bool operator==(const Vertex&) const = default;
    };
    constexpr std::uint32_t kNone = 0xffffffff;
    std::vector<std::uint32_t> atPoint(faces.points.size() / 3, kNone), next;
    std::vector<Vertex> vertices;
    MeshData data;
    std::vector<std::uint32_t> corners, lengths;
    const auto vertexOf = [&](std::size_t face, std::uint32_t point, std::size_t corner) {
        Vertex made;
        if (normals) {
            const float* n = normals->at(face, point, corner);
            const Vec3f unit = Vec3f(n[0], n[1], n[2]).normalized();
            const bool sound = unit.allFinite() && unit.norm() > 0.5F;
            for (std::size_t i = 0; i < 3; ++i) made.numbers[i] = sound ? unit[static_cast<int>(i)] : i == 1 ? 1.0F : 0;
        }
        for (std::size_t set = 0; set < 2; ++set)
            if (texcoords[set]) {
                const float* uv = texcoords[set]->at(face, point, corner);
                made.numbers[3 + 2 * set] = std::isfinite(uv[0]) ? uv[0] : 0;
                made.numbers[4 + 2 * set] = std::isfinite(uv[1]) ? 1 - uv[1] : 0;  // from the upper left corner
            }
        if (colors)
            for (std::size_t i = 0; i < 3; ++i)
                made.color[i] = colorByte(srgbOfLinear(std::max(colors->at(face, point, corner)[i], 0.0F)));
        if (opacities) made.color[3] = colorByte(*opacities->at(face, point, corner));
        int looked = 0;
        for (std::uint32_t known = atPoint[point]; known != kNone && looked < kMostVerticesAtPoint;
             known = next[known], ++looked)
            if (vertices[known] == made) return known;
        const auto index = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(made);
        next.push_back(atPoint[point]);
        atPoint[point] = index;
        const float* p = faces.points.data() + std::size_t{3} * point;
        data.positions.insert(data.positions.end(), p, p + 3);
        return index;
    };
    for (const std::uint32_t face : which) {
        const std::span<const std::uint32_t> points = faces.corners(face);
        for (std::size_t i = 0; i < points.size(); ++i) {
            // The first corner stays the first, whichever way around.
            const std::size_t k = faces.leftHanded ? (points.size() - i) % points.size() : i;
            corners.push_back(vertexOf(face, points[k], faces.first[face] + k));
        }
        lengths.push_back(static_cast<std::uint32_t>(points.size()));
    }
    for (const Vertex& vertex : vertices) {
        if (normals) data.normals.insert(data.normals.end(), vertex.numbers.begin(), vertex.numbers.begin() + 3);
        if (texcoords[0])
            data.texcoords.insert(data.texcoords.end(), vertex.numbers.begin() + 3, vertex.numbers.begin() + 5);
        if (texcoords[1])
            data.texcoords1.insert(data.texcoords1.end(), vertex.numbers.begin() + 5, vertex.numbers.end());
        if (colors || opacities) data.colors.insert(data.colors.end(), vertex.color.begin(), vertex.color.end());
    }
    if (std::ranges::all_of(lengths, [](std::uint32_t length) { return length == 3; })) {
        data.indices = std::move(corners);
        return data;
    }
    const PrimitiveRuns runs{RunKind::kPolygons, data.positions, corners, lengths};
    Expected<void> sound = checkRuns(runs);
    Expected<std::vector<std::uint32_t>> triangles = sound ? assembleRuns(runs) : tl::unexpected(sound.error());
    if (triangles) {
        data.indices = std::move(*triangles);
        return data;
    }
    // Outlines that cost too much to cut are shown as fans.
    remarks_.add("faces of very many corners are cut from their first corner", prim.path());
    std::size_t begin = 0;
    for (const std::uint32_t length : lengths) {
        for (std::size_t i = 2; i < length; ++i)
            data.indices.insert(data.indices.end(), {corners[begin], corners[begin + i - 1], corners[begin + i]});
        begin += length;
    }
    return data;
}

std::shared_ptr<const proto::scene::SubdivisionSurface> UsdMeshes::surfaceOf(const UsdComposedPrim& prim,
                                                                             const Faces& faces, const UsdLook& look,
                                                                             std::size_t groups) {
    using Message = proto::scene::SubdivisionSurface;
    if (faces.scheme != "catmullClark" && faces.scheme != "loop" && faces.scheme != "bilinear") return nullptr;
    // Without a word of the scheme whoever wrote normals meant polygons; bilinear ones are these.
    if (faces.scheme == "bilinear" || (!faces.schemeSaid && prim.attribute("normals"))) return nullptr;
    constexpr std::size_t kMostCorners = 64;
    const bool loop = faces.scheme == "loop";
    const char* why = nullptr;
    if (look.textured() || !look.colors.empty())
        why = "have textures or colours, which smooth surfaces here have not";
    else if (groups > 1)
        why = "have several materials, which smooth surfaces here have not";
    else if (loop && !faces.areTriangles())
        why = "have faces that are no triangles, which Loop's scheme wants";
    std::set<std::uint32_t> holes;
    for (const std::uint32_t hole : usdCounts(prim.attribute("holeIndices"))) holes.insert(hole);
    std::vector<std::uint32_t> faceOfUse(faces.points.size() / 3);
    for (std::size_t f = 0; f < faces.count() && why == nullptr; ++f) {
        const std::span<const std::uint32_t> corners = faces.corners(f);
        std::set<std::uint32_t> different(corners.begin(), corners.end());
        if (!(faces.sound[f] || holes.contains(static_cast<std::uint32_t>(f))) || different.size() != corners.size() ||
            corners.size() > kMostCorners || (!different.empty() && *different.rbegin() >= faceOfUse.size()))
            why = "have faces without an area, or with very many corners";
        else
            for (const std::uint32_t v : corners)
                if (++faceOfUse[v] > 200) why = "have vertices of very many faces";
    }
    if (why != nullptr) {
        remarks_.add(fmt::format("meshes of subdivision {}: their polygons are shown", why), prim.path());
        return nullptr;
    }
    auto surface = std::make_shared<Message>();
    surface->set_scheme(loop ? Message::LOOP : Message::CATMULL_CLARK);
    const std::string boundary = usdWord(prim, "interpolateBoundary", "edgeAndCorner");
    surface->set_boundary(boundary == "none"       ? Message::NO_BOUNDARY
                          : boundary == "edgeOnly" ? Message::EDGE_ONLY
                                                   : Message::EDGE_AND_CORNER);
    if (usdWord(prim, "triangleSubdivisionRule", "catmullClark") == "smooth") surface->set_triangles(Message::SMOOTH);
    for (float number : faces.points) surface->add_points(std::isfinite(number) ? number : 0);
    for (std::size_t f = 0; f < faces.count(); ++f) {
        const std::span<const std::uint32_t> corners = faces.corners(f);
        surface->add_face_sizes(static_cast<std::uint32_t>(corners.size()));
        for (std::size_t i = 0; i < corners.size(); ++i)
            surface->add_face_vertices(corners[faces.leftHanded ? (corners.size() - i) % corners.size() : i]);
    }
    for (const std::uint32_t hole : holes)
        if (hole < faces.count()) surface->add_holes(hole);
    // A crease is a chain of vertices; those that are no edges are of other software's making.
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    const std::vector<std::uint32_t> chain = usdCounts(prim.attribute("creaseIndices")),
                                     lengths = usdCounts(prim.attribute("creaseLengths"));
    if (!chain.empty())
        for (std::size_t f = 0; f < faces.count(); ++f)
            for (std::size_t i = 0; i < faces.corners(f).size(); ++i) {
                const std::uint32_t a = faces.corners(f)[i], b = faces.corners(f)[(i + 1) % faces.corners(f).size()];
                edges.insert(std::minmax(a, b));
            }
    const auto numbersOf = [&](const char* name) {
        const std::optional<UsdAttribute> said = prim.attribute(name);
        return said && said->value ? said->value->numbers<float>() : std::vector<float>();
    };
    const auto sharp = [](float said) { return std::isfinite(said) ? std::clamp(said, 0.0F, 10.0F) : 10.0F; };
    const std::vector<float> sharpness = numbersOf("creaseSharpnesses");
    std::size_t at = 0, edge = 0;
    for (std::size_t c = 0; c < lengths.size() && lengths[c] <= chain.size() - at; ++c) {
        for (std::size_t i = 1; i < lengths[c]; ++i, ++edge) {
            // One for each crease, or one for each of its edges.
            const std::size_t which = sharpness.size() == lengths.size() ? c : edge;
            if (!edges.contains(std::minmax(chain[at + i - 1], chain[at + i]))) continue;
            surface->add_creases(chain[at + i - 1]);
            surface->add_creases(chain[at + i]);
            surface->add_crease_sharpness(which < sharpness.size() ? sharp(sharpness[which]) : 10);
        }
        at += lengths[c];
    }
    const std::vector<float> cornerSharpness = numbersOf("cornerSharpnesses");
    const std::vector<std::uint32_t> sharpVertices = usdCounts(prim.attribute("cornerIndices"));
    for (std::size_t i = 0; i < sharpVertices.size(); ++i) {
        if (sharpVertices[i] >= faces.points.size() / 3) continue;
        surface->add_corners(sharpVertices[i]);
        surface->add_corner_sharpness(i < cornerSharpness.size() ? sharp(cornerSharpness[i]) : 10);
    }
    surface->set_material(look.material);
    return surface;
}

UsdLook UsdMeshes::lookOf(const UsdComposedPrim& prim, const std::string& material, bool surface) {
    const std::optional<UsdAttribute> sides = prim.attribute("doubleSided");
    const bool otherwise = prim.type() == "Plane";
    const bool doubleSided = surface && (sides && sides->value ? sides->value->truth(otherwise) : otherwise);
    if (!material.empty())
        if (const Expected<UsdLook> look = materials_.look(material, doubleSided); look && !look->material.empty())
            return *look;
    const std::optional<UsdAttribute> colors = usdPrimvarOf(prim, worn_.primvars, "primvars:displayColor"),
                                      opacities = usdPrimvarOf(prim, worn_.primvars, "primvars:displayOpacity");
    bool transparent = false;
    if (opacities && opacities->value)
        for (const float opacity : opacities->value->numbers<float>()) transparent = transparent || opacity < 1;
    const bool colored = colors && colors->value && colors->value->count() > 0;
    if (!colored && !transparent && !doubleSided) return {};
    UsdLook look = materials_.colored(doubleSided, transparent);
    if (colored || transparent) look.colors = "displayColor";
    return look;
}

std::vector<UsdPart> UsdMeshes::added(const UsdComposedPrim& prim, MeshData data, const UsdLook& look) {
    if (const std::string leftOut = keepSoundParts(data, prim.path()); !leftOut.empty()) scene_.noteMissing(leftOut);
    if (data.empty()) return {};
    UsdPart part{fmt::format("mesh {}", scene_.file.mesh_size()), look.material, nullptr, boundsOf(data.positions)};
    scene_.addModelMesh(part.mesh, std::move(data), limits_);
    return {std::move(part)};
}

Expected<std::vector<UsdPart>> UsdMeshes::ofMesh(const UsdComposedPrim& prim, const std::string& material) {
    Expected<Faces> faces = facesOf(prim);
    if (!faces) return tl::unexpected(faces.error());
    const auto groups = groupsOf(prim, material, *faces);
    if (!groups) return tl::unexpected(groups.error());
    std::vector<UsdPart> parts;
    if (groups->size() == 1) {
        const UsdLook look = lookOf(prim, groups->front().first, true);
        if (auto surface = surfaceOf(prim, *faces, look, groups->size()))
            return std::vector<UsdPart>{{"", look.material, std::move(surface), boundsOf(faces->points)}};
    } else if (!groups->empty()) {
        (void)surfaceOf(prim, *faces, {}, groups->size());
    }
    const std::optional<UsdPrimvar> normals = normalsOf(prim, *faces);
    for (const auto& [bound, which] : *groups) {
        const UsdLook look = lookOf(prim, bound, true);
        for (UsdPart& part : added(prim, meshOf(prim, *faces, which, look, normals), look))
            parts.push_back(std::move(part));
    }
    return parts;
}

std::size_t UsdMeshes::numberOf(const UsdValuePtr& value) {
    const auto [known, isNew] = numbers_.try_emplace(value, 0);
    if (!isNew) return known->second;
    Hash128 hash;
    std::visit(
        [&]<typename Data>(const Data& data) {
            if constexpr (std::is_same_v<Data, UsdValue::Words>)
                hash = hash128(asBytes(fmt::format("{}", fmt::join(data, "\n"))));
            else if constexpr (requires { data.data(); })
                hash = hash128(std::as_bytes(std::span(data)));
        },
        value->data);
    std::vector<UsdValuePtr>& like = values_[hash];
    for (const UsdValuePtr& other : like)
        if (other->data == value->data && other->array == value->array) return known->second = numbers_.at(other);
    like.push_back(value);
    return known->second = numbers_.size();
}

Expected<std::vector<UsdPart>> UsdMeshes::parts(const UsdComposedPrim& prim, const UsdWorn& worn) {
    worn_ = worn;
    const std::string& material = worn_.material;
    // What it is made of: its values, wherever they stand, and its material. Places are another matter.
    std::string key = fmt::format("{}\n{} {}{}", prim.type(), lookOf(prim, material, true).material,
                                  worn_.holds ? "holds" : "", usdPrintOf(worn_.primvars));
    for (const std::string& name : prim.propertyNames()) {
        if (name.starts_with("xformOp") || name == "visibility" || name == "purpose") continue;
        const std::optional<UsdAttribute> attribute = prim.attribute(name);
        if (attribute && attribute->value) key += fmt::format("\n{} {}", name, numberOf(attribute->value));
    }
    for (const std::string& name : prim.childNames()) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        if ((*child)->type() != "GeomSubset") continue;
        const std::optional<UsdAttribute> faces = (*child)->attribute("indices");
        key += fmt::format("\n{} {}", faces && faces->value ? numberOf(faces->value) : 0,
                           lookOf(prim, usdBoundMaterial(**child), true).material);
    }
    if (const auto known = known_.find(key); known != known_.end()) return known->second;
    Expected<std::vector<UsdPart>> made;
    if (prim.type() == "Mesh")
        made = ofMesh(prim, material);
    else if (prim.type() == "Points")
        made = ofPoints(prim, material);
    else if (prim.type() == "BasisCurves")
        made = ofCurves(prim, material);
    else
        made = ofShape(prim, material);
    if (made) known_.emplace(std::move(key), *made);
    return made;
}

}  // namespace tessera
