// The tree as a table: a line for each node, as spreadsheets read it (RFC 4180).

#include <fmt/format.h>

#include "common/drawable/Drawable.h"
#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/WorldMeshes.h"

namespace tessera {
namespace {

std::string csvQuoted(std::string_view text) {
    if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted += '"';
}

/// Materials have no names: colour as pages write it, and how it shines.
std::string lookOf(const Material& material) {
    const std::array<std::uint8_t, 4> c = colorBytes(material.baseColor);
    std::string look = fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
    if (c[3] != 255) look += fmt::format("{:02x}", c[3]);
    return look + fmt::format(" metallic {} roughness {}", material.metallic, material.roughness);
}

/// As all formats count them: points are shown as faces, and have none.
std::uint64_t trianglesOf(const Drawable& drawable) {
    const bool isPoints = !drawable.derived() && drawable.arrays().kind == MeshKind::kPoints;
    return isPoints ? 0 : drawable.triangleCount();
}

}  // namespace

Expected<LeavingFiles> writeCsv(const LeavingScene& leaving) {
    const std::vector<SelectedNode>& nodes = leaving.selection.nodes;
    std::vector<ObjectId> ids;
    std::vector<Box> boxes(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        ids.push_back(nodes[i].id);
        const Drawable drawable = nodes[i].isWay ? Drawable() : drawableOf(nodes[i].core);
        if (!drawable) continue;
        if (!drawable.resident())
            return fail(ErrorCode::kRefused, pathOf(leaving.scene, nodes[i].id) + ": an array of it is not here");
        if (const Box own = drawable.bounds(); !own.empty()) boxes[i] = own.transformed(nodes[i].world_T_node);
    }
    // Children come behind their parents.
    for (std::size_t i = nodes.size(); i-- > 0;)
        if (nodes[i].parent != SelectedNode::kNone && !boxes[i].empty()) boxes[nodes[i].parent].extend(boxes[i]);
    const std::vector<std::string> paths = pathsOf(leaving.scene, ids);
    LeavingFiles files{.files = {{.path = leaving.path, .parts = {}}}, .nodes = nodes.size()};
    std::string text = "path,type,x,y,z,size_x,size_y,size_z,triangles,material\r\n";
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const SelectedNode& node = nodes[i];
        const Drawable drawable = node.isWay ? Drawable() : drawableOf(node.core);
        const Vec3d at = node.world_T_node.translation();
        const Vec3d size = boxes[i].empty() ? Vec3d(Vec3d::Zero()) : boxes[i].size();
        const std::uint64_t triangles = drawable ? trianglesOf(drawable) : 0;
        files.triangles += triangles;
        text += fmt::format(
            "{},{},{},{},{},{},{},{},{},{}\r\n", csvQuoted(paths[i]),
            node.core ? node.core.info().name : std::string_view(), at[0], at[1], at[2], size[0], size[1], size[2],
            triangles,
            drawable ? lookOf(materialOf(leaving.scene, node.materialFor(drawable.material()))) : std::string());
    }
    files.files.front().parts = {sliceOfText(std::move(text))};
    return files;
}

}  // namespace tessera
