// Free-form surfaces of OBJ files: control points, knots and trims go on as they are; who has the scene makes triangles
// of them.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/freeform/nurbs/ObjSurfaces.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/NurbsMessage.h"
#include "server/import/reader/ObjMaterials.h"
#include "server/import/reader/ReadScene.h"

namespace tessera {
namespace {

/// What the statements around surfaces say of them, in the file's order.
struct ObjSurfaceNames {
    std::vector<std::string> groups;     ///< of each surf
    std::vector<std::string> materials;  ///< of each surf that in force; empty: none
    std::vector<std::string> libraries;  ///< as mtllib says them
    bool faces = false, others = false;  ///< polygons; lines and points
};

ObjSurfaceNames namesIn(std::string_view text) {
    ObjSurfaceNames names;
    std::string group, material;
    bool continued = false;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        const bool begins = !continued;
        continued = !line.empty() && line.back() == '\\';
        if (!begins) continue;
        line.remove_prefix(std::min(line.find_first_not_of(" \t\v\f"), line.size()));
        const std::size_t word = std::min(line.find_first_of(" \t\v\f\\#"), line.size());
        const std::string_view key = line.substr(0, word);
        std::string_view rest = line.substr(word);
        rest.remove_prefix(std::min(rest.find_first_not_of(" \t\v\f"), rest.size()));
        // Names of materials and libraries may have spaces.
        const std::string whole(rest.substr(0, rest.find_last_not_of(" \t\v\f") + 1));
        rest = rest.substr(0, std::min(rest.find_first_of(" \t\v\f\\#"), rest.size()));
        if (key == "g" || key == "o") {
            group = foreignName(rest, "");
        }
        if (key == "usemtl") material = whole;
        if (key == "mtllib" && !whole.empty()) names.libraries.push_back(whole);
        if (key == "f") names.faces = true;
        if (key == "l" || key == "p") names.others = true;
        if (key == "surf") {
            names.groups.push_back(group);
            names.materials.push_back(material);
        }
    }
    return names;
}

/// The materials that surfaces take, by their names in the file. A file without a library says nothing of looks.
std::map<std::string, std::string> materialsOf(const ObjSurfaceNames& names, const std::string& path,
                                               const ReadLimits& limits, PlainScene& scene) {
    std::set<std::string> used(names.materials.begin(), names.materials.end());
    used.erase("");
    if (names.libraries.empty() || used.empty()) return {};
    const FolderFiles files(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1)), limits.maxFileBytes);
    std::map<std::string, std::string> materials =
        readObjMaterials(names.libraries, {used.begin(), used.end()}, path, files, limits, scene);
    noteObjMaterials(path, files, scene);
    return materials;
}

}  // namespace

Expected<PlainScene> readObjSurfaces(const std::string& path, const ReadLimits& limits) {
    const Expected<Bytes> bytes = readOrdinaryFile(path, limits.maxFileBytes);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const ObjSurfaceNames names = namesIn(text);
    if (names.groups.empty()) return fail(ErrorCode::kUnsupported, "it has no free-form surfaces");
    const Expected<std::vector<NurbsSurface>> surfaces = readNurbsObj(text, "line");
    if (!surfaces) return tl::unexpected(surfaces.error());
    PlainScene scene;
    if (names.faces) {
        // assimp takes `parm` for points and gives up.
        Expected<PlainScene> faces = readTextMesh(path, "obj", limits);
        if (!faces) return faces;
        scene = std::move(*faces);
        scene.note("polygons beside free-form surfaces are read without materials, normals and texture coordinates");
    }
    if (const std::string leftOut = noteOfFreeform(text); !leftOut.empty()) scene.note(leftOut);
    if (names.others) scene.note("lines and points beside free-form surfaces are left out");
    if (surfaces->size() > limits.maxNodes)
        return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits.maxNodes));
    // Seen from both sides: the format does not say which is the outside.
    std::string material = "surfaces";
    const auto isTaken = [&] {
        return std::any_of(scene.file.material().begin(), scene.file.material().end(),
                           [&](const auto& m) { return m.name() == material; });
    };
    while (isTaken()) material += "'";
    proto::scene::Material* sided = scene.file.add_material();
    sided->set_name(material);
    sided->set_double_sided(true);
    const std::map<std::string, std::string> materials = materialsOf(names, path, limits, scene);
    for (std::size_t i = 0; i < surfaces->size(); ++i) {
        proto::scene::Node* node = scene.file.add_node();
        const std::string group = i < names.groups.size() ? names.groups[i] : std::string();
        node->set_name(group.empty() ? fmt::format("surface {}", i + 1) : group);
        setSurface(*node->mutable_nurbs_surface(), (*surfaces)[i]);
        const auto own = i < names.materials.size() ? materials.find(names.materials[i]) : materials.end();
        node->mutable_nurbs_surface()->set_material(own == materials.end() ? material : own->second);
    }
    return scene;
}

}  // namespace tessera
