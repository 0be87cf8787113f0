#include "common/export/UsdaShapes.h"

#include <algorithm>
#include <numeric>

#include "common/cores/SubdivisionSurface.h"
#include "common/export/LeavingLooks.h"
#include "common/export/UsdaText.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

/// Of the vertices in this order.
std::string vertexColors(const MeshArrays& arrays, std::span<const std::uint32_t> order, const std::string& in) {
    if (arrays.colors.empty()) return {};
    std::vector<float> linear;
    const std::span<const std::uint8_t> bytes = arrays.colors.as<std::uint8_t>();
    for (const std::uint32_t vertex : order)
        for (std::size_t k = 0; k < 3; ++k)
            linear.push_back(linearOfSrgb(static_cast<float>(bytes[std::size_t{4} * vertex + k]) / 255));
    return fmt::format("{}color3f[] primvars:displayColor = {} (\n{}    interpolation = \"vertex\"\n{})\n", in,
                       usdTuples(linear, 3), in, in);
}

/// USD's words are OpenSubdiv's, as ours.
std::string smoothShape(const SubdivisionSurface& s, const std::string& in) {
    const auto word = [](std::int64_t number, std::initializer_list<const char*> words) {
        return *(words.begin() + std::clamp<std::int64_t>(number, 0, static_cast<std::int64_t>(words.size()) - 1));
    };
    std::string text = fmt::format("{}uniform token subdivisionScheme = \"{}\"\n", in,
                                   word(s.scheme, {"catmullClark", "loop", "bilinear"}));
    text += fmt::format("{}uniform token interpolateBoundary = \"{}\"\n", in,
                        word(s.boundary, {"none", "edgeOnly", "edgeAndCorner"}));
    text += fmt::format("{}uniform token triangleSubdivisionRule = \"{}\"\n", in,
                        word(s.triangles, {"catmullClark", "smooth"}));
    text += fmt::format("{}point3f[] points = {}\n{}int[] faceVertexCounts = {}\n{}int[] faceVertexIndices = {}\n", in,
                        usdTuples(s.points.as<float>(), 3), in, usdList(s.faceSizes.as<std::uint32_t>()), in,
                        usdList(s.faceVertices.as<std::uint32_t>()));
    const auto sharpness = [](const Blob& said, std::size_t count) {
        const std::span<const float> values = said.as<float>();
        return values.empty() ? std::vector<float>(count, 10) : std::vector<float>(values.begin(), values.end());
    };
    if (const auto creases = s.creases.as<std::uint32_t>(); !creases.empty())
        text +=
            fmt::format("{}int[] creaseIndices = {}\n{}int[] creaseLengths = {}\n{}float[] creaseSharpnesses = {}\n",
                        in, usdList(creases), in, usdList(std::vector<int>(creases.size() / 2, 2)), in,
                        usdList(sharpness(s.creaseSharpness, creases.size() / 2)));
    if (const auto corners = s.corners.as<std::uint32_t>(); !corners.empty())
        text += fmt::format("{}int[] cornerIndices = {}\n{}float[] cornerSharpnesses = {}\n", in, usdList(corners), in,
                            usdList(sharpness(s.cornerSharpness, corners.size())));
    if (const auto holes = s.holes.as<std::uint32_t>(); !holes.empty())
        text += fmt::format("{}int[] holeIndices = {}\n", in, usdList(holes));
    return text;
}

void noteLosses(const SelectedNode& node, const MeshArrays& arrays, ExportNotes& notes) {
    const bool particles =
        arrays.kind == MeshKind::kDiscs || arrays.kind == MeshKind::kSprites || arrays.kind == MeshKind::kStreaks;
    if (particles) notes.add("particles are written as points or lines, without their sizes", node.id);
    if (arrays.kind == MeshKind::kLines && arrays.lineWidth != 1) notes.add("widths of lines are left out", node.id);
    if (!arrays.tangents.empty()) notes.add("tangents of vertices are left out", node.id);
    if (arrays.kind == MeshKind::kGlyphs) {
        const std::span<const std::uint8_t> each = arrays.colors.as<std::uint8_t>();
        for (std::size_t i = 3; i < each.size(); i += 4)
            if (each[i] != 255) return notes.add("opacities of glyphs are left out", node.id);
        return;
    }
    noteLostOpacities(arrays.colors.as<std::uint8_t>(), notes, node.id);
}

}  // namespace

std::string_view usdShapeType(const MeshArrays& arrays) {
    const bool lines = arrays.kind == MeshKind::kLines || arrays.kind == MeshKind::kStreaks;
    return arrays.kind == MeshKind::kTriangles || arrays.kind == MeshKind::kGlyphs ? "Mesh"
           : lines                                                                 ? "BasisCurves"
                                                                                   : "Points";
}

std::string usdShape(const SelectedNode& node, const MeshArrays& arrays, const std::string& in, ExportNotes& notes) {
    if (const auto* surface = node.core.as<SubdivisionSurface>()) {
        const SubdivisionSurface usual;
        if (surface->level != usual.level || surface->creaseMethod != usual.creaseMethod)
            notes.add("how finely, and by which rule of creases, subdivision surfaces are drawn is left out", node.id);
        return smoothShape(*surface, in);
    }
    const std::span<const float> positions = arrays.positions.as<float>();
    std::string text;
    std::vector<std::uint32_t> all(positions.size() / 3);
    std::iota(all.begin(), all.end(), 0u);
    const std::string_view kind = usdShapeType(arrays);
    noteLosses(node, arrays, notes);
    if (kind == "Points") {
        text += fmt::format("{}point3f[] points = {}\n", in, usdTuples(positions, 3));
        if (arrays.pointRadius > 0)
            text += fmt::format("{}float[] widths = [{}] (\n{}    interpolation = \"constant\"\n{})\n", in,
                                2 * arrays.pointRadius, in, in);
        return text + vertexColors(arrays, all, in);
    }
    if (kind == "BasisCurves") {
        std::vector<float> ends;
        const std::span<const std::uint32_t> order = arrays.lines.as<std::uint32_t>();
        for (const std::uint32_t corner : order)
            ends.insert(ends.end(), &positions[std::size_t{3} * corner], &positions[std::size_t{3} * corner] + 3);
        text += fmt::format("{}uniform token type = \"linear\"\n{}point3f[] points = {}\n", in, in, usdTuples(ends, 3));
        const std::vector<int> counts(ends.size() / 6, 2);
        return text + fmt::format("{}int[] curveVertexCounts = {}\n", in, usdList(counts)) +
               vertexColors(arrays, order, in);
    }
    const std::span<const std::uint32_t> corners = arrays.indices.as<std::uint32_t>();
    const std::vector<int> counts(corners.size() / 3, 3);
    text += fmt::format("{}uniform token subdivisionScheme = \"none\"\n{}point3f[] points = {}\n", in, in,
                        usdTuples(positions, 3));
    text += fmt::format("{}int[] faceVertexCounts = {}\n{}int[] faceVertexIndices = {}\n", in, usdList(counts), in,
                        usdList(corners.first(3 * counts.size())));
    if (!arrays.normals.empty())
        text += fmt::format("{}normal3f[] normals = {} (\n{}    interpolation = \"vertex\"\n{})\n", in,
                            usdTuples(arrays.normals.as<float>(), 3), in, in);
    for (const auto& [blob, name] : {std::pair(&arrays.texcoords, "st"), std::pair(&arrays.texcoords1, "st1")}) {
        if (blob->empty()) continue;
        std::vector<float> uv(blob->as<float>().begin(), blob->as<float>().end());
        for (std::size_t i = 1; i < uv.size(); i += 2) uv[i] = 1 - uv[i];  // from the lower left
        text += fmt::format("{}texCoord2f[] primvars:{} = {} (\n{}    interpolation = \"vertex\"\n{})\n", in, name,
                            usdTuples(uv, 2), in, in);
    }
    return text + (arrays.kind == MeshKind::kGlyphs ? std::string() : vertexColors(arrays, all, in));
}

}  // namespace tessera
