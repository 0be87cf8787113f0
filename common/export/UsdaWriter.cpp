// A scene as USD in text: Xforms, meshes that instances refer to, UsdPreviewSurface, lights, cameras, time samples.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <numbers>

#include "common/cores/Material.h"
#include "common/cores/Skin.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/LeavingMeshes.h"
#include "common/export/LeavingPictures.h"
#include "common/export/NodeTracks.h"
#include "common/export/PlannedTree.h"
#include "common/export/UniqueNames.h"
#include "common/export/WorldMeshes.h"
#include "common/field/LightSource.h"
#include "common/geometry/MeshCopies.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

/// USD's identifiers: letters, digits, '_', no digit first.
std::string primName(std::string_view name) {
    std::string plain;
    for (const char c : name) {
        const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        plain += good ? c : '_';
    }
    if (plain.empty()) plain = "node";
    if (plain.front() >= '0' && plain.front() <= '9') plain.insert(0, 1, '_');
    return plain;
}

std::string usdQuoted(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            (quoted += '\\') += c;
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            quoted += fmt::format("\\x{:02x}", c);
        else
            quoted += c;
    }
    return quoted += '"';
}

/// "(1, 2, 3)"
template <typename Vector>
std::string tuple(const Vector& v) {
    return fmt::format("({})", fmt::join(v.begin(), v.end(), ", "));
}

/// "[(0, 0, 0), …]"; numbers that are none are 0.
std::string tuples(std::span<const float> values, std::size_t each) {
    std::string text = "[";
    auto to = std::back_inserter(text);
    for (std::size_t i = 0; i + each <= values.size(); i += each) {
        text += i == 0 ? "(" : ", (";
        for (std::size_t k = 0; k < each; ++k)
            fmt::format_to(to, "{}{}", k == 0 ? "" : ", ", std::isfinite(values[i + k]) ? values[i + k] : 0.0f);
        text += ')';
    }
    return text += ']';
}

template <typename Numbers>
std::string numberList(const Numbers& values) {
    return fmt::format("[{}]", fmt::join(values, ", "));
}

class UsdaWriter {
public:
    explicit UsdaWriter(const LeavingScene& leaving)
        : leaving_(leaving),
          companions_(leaving.path),
          top_(primName(std::filesystem::path(leaving.path).stem().string())),
          tree_(planTree(leaving.scene, leaving.selection, leaving.notes)),
          meshes_(leaving.scene, leaving.options.tolerance, leaving.notes) {}

    Expected<LeavingFiles> run() {
        if (!leaving_.options.still)
            for (NodeTrack& track : nodeTracks(leaving_.scene, leaving_.selection, tree_, leaving_.notes)) {
                for (const double time : track.times) end_ = std::max(end_, time);
                tracks_[track.node].push_back(std::move(track));
            }
        for (const PlannedNode& node : tree_.nodes)
            for (const std::size_t shape : node.shapes) ++uses_[selected(shape).node->core];
        UniqueNames taken("_");
        for (const char* own : {"Looks", "Shapes"}) taken.take(own);
        for (const int top : tree_.tops)
            if (Expected<void> done = addNode(top, 1, taken); !done) return tl::unexpected(done.error());
        std::string head = fmt::format("#usda 1.0\n# {}\n(\n", companions_.mark());
        head += fmt::format("    defaultPrim = \"{}\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n", top_);
        if (!tracks_.empty())
            head += fmt::format(
                "    startTimeCode = 0\n    endTimeCode = {}\n    timeCodesPerSecond = {}\n"
                "    framesPerSecond = {}\n",
                end_ * kCodesPerSecond, kCodesPerSecond, kCodesPerSecond);
        head += fmt::format(")\n\ndef Xform \"{}\" (\n    kind = \"assembly\"\n)\n{{\n", top_);
        if (!shapes_.empty()) head += "    class Scope \"Shapes\"\n    {\n" + shapes_ + "    }\n";
        if (!looks_.empty()) head += "    def Scope \"Looks\"\n    {\n" + looks_ + "    }\n";
        const std::uint64_t bytes = head.size() + text_.size() + 2;
        if (Expected<void> fits = checkFileBytes(bytes, leaving_.options); !fits) return tl::unexpected(fits.error());
        files_.files.push_back(
            {.path = leaving_.path,
             .parts = {sliceOfText(std::move(head)), sliceOfText(std::move(text_)), sliceOfText("}\n")}});
        files_.nodes = tree_.nodes.size();
        return std::move(files_);
    }

private:
    static constexpr double kCodesPerSecond = 60;

    [[nodiscard]] const SelectedNode& selected(std::size_t index) const { return leaving_.selection.nodes[index]; }
    static std::string indent(std::size_t depth) { return std::string(4 * depth, ' '); }
    static std::string uniqueName(std::string_view name, UniqueNames& taken) { return taken.take(primName(name)); }

    Expected<void> addNode(int index, std::size_t depth, UniqueNames& siblings) {
        const PlannedNode& node = tree_.nodes[static_cast<std::size_t>(index)];
        const std::string name = uniqueName(node.name, siblings);
        const std::string in = indent(depth + 1);
        text_ += fmt::format("{}def Xform \"{}\"", indent(depth), name);
        if (name != node.name && !node.name.empty())
            text_ += fmt::format(" (\n{}displayName = {}\n{})", in, usdQuoted(node.name), indent(depth));
        text_ += fmt::format("\n{}{{\n", indent(depth));
        addPlace(index, node, in);
        UniqueNames taken("_");
        for (const std::size_t shape : node.shapes)
            if (Expected<void> done = addShape(selected(shape), depth + 1, taken); !done) return done;
        if (node.glyphs)
            if (Expected<void> done = addGlyphs(selected(*node.glyphs), depth + 1, taken); !done) return done;
        if (node.light) addLight(selected(*node.light), node.lightName, depth + 1, taken);
        if (node.camera)
            text_ += fmt::format(
                "{}def Camera \"{}\"\n{}{{\n{}float focalLength = {}\n{}float verticalAperture = 24\n"
                "{}float horizontalAperture = {}\n{}float2 clippingRange = (0.01, 100000)\n{}}}\n",
                in, uniqueName(node.cameraName, taken), in, in + "    ", 12 / std::tan(0.5 * node.yfov), in + "    ",
                in + "    ", 24.0 * 16 / 9, in + "    ", in);
        for (const int child : node.children)
            if (Expected<void> done = addNode(child, depth + 1, taken); !done) return done;
        text_ += indent(depth) + "}\n";
        return {};
    }

    void addPlace(int index, const PlannedNode& node, const std::string& in) {
        struct Part {
            std::string_view field, op, type;
            std::string value;
            bool isSaid;
        };
        const Quatd& q = node.rotation;
        Part parts[] = {
            {"translation", "translate", "double3", tuple(node.translation), node.translation != Vec3d::Zero()},
            {"rotation", "orient", "quatd", fmt::format("({}, {}, {}, {})", q.w(), q.x(), q.y(), q.z()),
             std::abs(q.w()) < 1},
            {"scale", "scale", "double3", tuple(node.scale), node.scale != Vec3d::Ones()}};
        std::string order;
        const auto moving = tracks_.find(index);
        for (Part& part : parts) {
            const NodeTrack* track = nullptr;
            if (moving != tracks_.end())
                for (const NodeTrack& one : moving->second)
                    if (one.field == part.field) track = &one;
            if (!track && !part.isSaid) continue;
            text_ += fmt::format("{}{} xformOp:{} = {}\n", in, part.type, part.op, part.value);
            if (track) addSamples(*track, part.type, part.op, in);
            order += fmt::format("{}\"xformOp:{}\"", order.empty() ? "" : ", ", part.op);
        }
        if (!order.empty()) text_ += fmt::format("{}uniform token[] xformOpOrder = [{}]\n", in, order);
    }

    void addSamples(const NodeTrack& track, std::string_view type, std::string_view op, const std::string& in) {
        text_ += fmt::format("{}{} xformOp:{}.timeSamples = {{\n", in, type, op);
        const std::size_t each = track.field == "rotation" ? 4 : 3;
        for (std::size_t i = 0; i < track.times.size(); ++i)
            text_ += fmt::format(
                "{}    {}: ({}),\n", in, track.times[i] * kCodesPerSecond,
                fmt::join(track.values[i].begin(), track.values[i].begin() + static_cast<std::ptrdiff_t>(each), ", "));
        text_ += in + "}\n";
    }

    /// A mesh of its own, or a reference to the one that others have too.
    Expected<void> addShape(const SelectedNode& node, std::size_t depth, UniqueNames& taken) {
        const Expected<MeshArrays> arrays = meshes_.of(node);
        if (!arrays) return tl::unexpected(arrays.error());
        if (arrays->positions.empty()) return {};
        if (node.core.is<Skin>()) leaving_.notes.add("skins stand still", node.id);
        const std::string kind = kindOf(*arrays);
        const std::string in = indent(depth), more = indent(depth + 1);
        const ObjectId material = node.materialFor(drawableOf(node.core).material());
        files_.triangles += arrays->indices.sizeBytes() / (3 * sizeof(std::uint32_t));
        text_ += fmt::format("{}def {} \"{}\" (\n", in, kind, uniqueName(node.node->name, taken));
        const bool shared = uses_[node.node->core] > 1;
        if (shared) {
            auto [known, isNew] = known_.try_emplace(node.node->core, fmt::format("shape_{}", known_.size()));
            if (isNew)
                shapes_ += fmt::format("        def {} \"{}\"\n        {{\n{}        }}\n", kind, known->second,
                                       shape(node, *arrays, indent(3)));
            text_ += fmt::format("{}prepend references = </{}/Shapes/{}>\n", more, top_, known->second);
        }
        text_ += fmt::format("{}prepend apiSchemas = [\"MaterialBindingAPI\"]\n{})\n{}{{\n", more, in, in);
        if (!shared) text_ += shape(node, *arrays, more);
        if (material || arrays->kind == MeshKind::kTriangles) {
            text_ += fmt::format("{}rel material:binding = </{}/Looks/{}>\n", more, top_, look(material, node.id));
            if (materialOf(leaving_.scene, material).doubleSided)
                text_ += fmt::format("{}uniform bool doubleSided = 1\n", more);
        }
        text_ += in + "}\n";
        return {};
    }

    static std::string kindOf(const MeshArrays& arrays) {
        const bool lines = arrays.kind == MeshKind::kLines || arrays.kind == MeshKind::kStreaks;
        return arrays.kind == MeshKind::kTriangles || arrays.kind == MeshKind::kGlyphs ? "Mesh"
               : lines                                                                 ? "BasisCurves"
                                                                                       : "Points";
    }

    std::string shape(const SelectedNode& node, const MeshArrays& arrays, const std::string& in) {
        if (const auto* surface = node.core.as<SubdivisionSurface>()) return smoothShape(*surface, in);
        const std::span<const float> positions = arrays.positions.as<float>();
        std::string text;
        const std::string kind = kindOf(arrays);
        if (kind == "Points") {
            text += fmt::format("{}point3f[] points = {}\n", in, tuples(positions, 3));
            if (arrays.pointRadius > 0)
                text += fmt::format("{}float[] widths = [{}] (\n{}    interpolation = \"constant\"\n{})\n", in,
                                    2 * arrays.pointRadius, in, in);
            return text + colors(arrays, in);
        }
        if (kind == "BasisCurves") {
            std::vector<float> ends;
            for (const std::uint32_t corner : arrays.lines.as<std::uint32_t>())
                ends.insert(ends.end(), &positions[std::size_t{3} * corner], &positions[std::size_t{3} * corner] + 3);
            text +=
                fmt::format("{}uniform token type = \"linear\"\n{}point3f[] points = {}\n", in, in, tuples(ends, 3));
            const std::vector<int> counts(ends.size() / 6, 2);
            return text + fmt::format("{}int[] curveVertexCounts = {}\n", in, numberList(counts));
        }
        const std::span<const std::uint32_t> corners = arrays.indices.as<std::uint32_t>();
        const std::vector<int> counts(corners.size() / 3, 3);
        text += fmt::format("{}uniform token subdivisionScheme = \"none\"\n{}point3f[] points = {}\n", in, in,
                            tuples(positions, 3));
        text += fmt::format("{}int[] faceVertexCounts = {}\n{}int[] faceVertexIndices = {}\n", in, numberList(counts),
                            in, numberList(corners.first(3 * counts.size())));
        if (!arrays.normals.empty())
            text += fmt::format("{}normal3f[] normals = {} (\n{}    interpolation = \"vertex\"\n{})\n", in,
                                tuples(arrays.normals.as<float>(), 3), in, in);
        for (const auto& [blob, name] : {std::pair(&arrays.texcoords, "st"), std::pair(&arrays.texcoords1, "st1")}) {
            if (blob->empty() || arrays.kind == MeshKind::kGlyphs) continue;
            std::vector<float> uv(blob->as<float>().begin(), blob->as<float>().end());
            for (std::size_t i = 1; i < uv.size(); i += 2) uv[i] = 1 - uv[i];  // from the lower left
            text += fmt::format("{}texCoord2f[] primvars:{} = {} (\n{}    interpolation = \"vertex\"\n{})\n", in, name,
                                tuples(uv, 2), in, in);
        }
        return text + (arrays.kind == MeshKind::kGlyphs ? std::string() : colors(arrays, in));
    }

    static std::string colors(const MeshArrays& arrays, const std::string& in) {
        if (arrays.colors.empty()) return {};
        std::vector<float> linear;
        const std::span<const std::uint8_t> bytes = arrays.colors.as<std::uint8_t>();
        for (std::size_t i = 0; i < bytes.size(); ++i)
            if (i % 4 != 3) linear.push_back(linearOfSrgb(static_cast<float>(bytes[i]) / 255));
        return fmt::format("{}color3f[] primvars:displayColor = {} (\n{}    interpolation = \"vertex\"\n{})\n", in,
                           tuples(linear, 3), in, in);
    }

    /// USD's words are OpenSubdiv's, as ours.
    static std::string smoothShape(const SubdivisionSurface& s, const std::string& in) {
        const auto word = [](std::int64_t number, std::initializer_list<const char*> words) {
            return *(words.begin() + std::clamp<std::int64_t>(number, 0, static_cast<std::int64_t>(words.size()) - 1));
        };
        std::string text = fmt::format("{}uniform token subdivisionScheme = \"{}\"\n", in,
                                       word(s.scheme, {"catmullClark", "loop", "bilinear"}));
        text += fmt::format("{}uniform token interpolateBoundary = \"{}\"\n", in,
                            word(s.boundary, {"none", "edgeOnly", "edgeAndCorner"}));
        text += fmt::format("{}uniform token triangleSubdivisionRule = \"{}\"\n", in,
                            word(s.triangles, {"catmullClark", "smooth"}));
        text += fmt::format("{}point3f[] points = {}\n{}int[] faceVertexCounts = {}\n{}int[] faceVertexIndices = {}\n",
                            in, tuples(s.points.as<float>(), 3), in, numberList(s.faceSizes.as<std::uint32_t>()), in,
                            numberList(s.faceVertices.as<std::uint32_t>()));
        const auto sharpness = [](const Blob& said, std::size_t count) {
            const std::span<const float> values = said.as<float>();
            return values.empty() ? std::vector<float>(count, 10) : std::vector<float>(values.begin(), values.end());
        };
        if (const auto creases = s.creases.as<std::uint32_t>(); !creases.empty())
            text += fmt::format(
                "{}int[] creaseIndices = {}\n{}int[] creaseLengths = {}\n{}float[] creaseSharpnesses = {}\n", in,
                numberList(creases), in, numberList(std::vector<int>(creases.size() / 2, 2)), in,
                numberList(sharpness(s.creaseSharpness, creases.size() / 2)));
        if (const auto corners = s.corners.as<std::uint32_t>(); !corners.empty())
            text += fmt::format("{}int[] cornerIndices = {}\n{}float[] cornerSharpnesses = {}\n", in,
                                numberList(corners), in, numberList(sharpness(s.cornerSharpness, corners.size())));
        if (const auto holes = s.holes.as<std::uint32_t>(); !holes.empty())
            text += fmt::format("{}int[] holeIndices = {}\n", in, numberList(holes));
        return text;
    }

    Expected<void> addGlyphs(const SelectedNode& node, std::size_t depth, UniqueNames& taken) {
        const Expected<MeshArrays> arrays = meshes_.of(node);
        if (!arrays) return tl::unexpected(arrays.error());
        const std::span<const MeshCopy> copies = arrays->copies.as<MeshCopy>();
        std::vector<float> places, turns, scales;
        for (const MeshCopy& copy : copies) {
            if (!(copy.width > 0) || !(copy.length > 0)) continue;
            places.insert(places.end(), copy.place.begin(), copy.place.end());
            turns.insert(turns.end(), {copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]});
            scales.insert(scales.end(), {copy.width, copy.length, copy.width});
        }
        if (places.empty()) return {};
        if (!arrays->colors.empty()) leaving_.notes.add("colours of glyphs are left out", node.id);
        files_.triangles += places.size() / 3 * (arrays->indices.sizeBytes() / (3 * sizeof(std::uint32_t)));
        const std::string in = indent(depth), more = indent(depth + 1);
        const std::string name = uniqueName("glyphs", taken);
        text_ += fmt::format("{}def PointInstancer \"{}\"\n{}{{\n", in, name, in);
        text_ += fmt::format("{}rel prototypes = <shape>\n{}int[] protoIndices = {}\n", more, more,
                             numberList(std::vector<int>(places.size() / 3, 0)));
        text_ += fmt::format("{}point3f[] positions = {}\n{}quath[] orientations = {}\n{}float3[] scales = {}\n", more,
                             tuples(places, 3), more, tuples(turns, 4), more, tuples(scales, 3));
        text_ += fmt::format("{}def Mesh \"shape\" (\n{}    prepend apiSchemas = [\"MaterialBindingAPI\"]\n{})\n{}{{\n",
                             more, more, more, more);
        text_ += shape(node, *arrays, indent(depth + 2));
        text_ += fmt::format("{}rel material:binding = </{}/Looks/{}>\n{}}}\n{}}}\n", indent(depth + 2), top_,
                             look(node.materialFor(drawableOf(node.core).material()), node.id), more, in);
        return {};
    }

    void addLight(const SelectedNode& node, const std::string& name, std::size_t depth, UniqueNames& taken) {
        const LightSource light = node.core.info().light(node.core.data());
        const bool directional = light.kind == LightSource::Kind::kDirectional;
        const bool spot = light.kind == LightSource::Kind::kSpot;
        const float strongest = std::max(light.radiance.maxCoeff(), 0.0f);
        const Vec3f color = strongest > 0 ? Vec3f(light.radiance / strongest) : Vec3f(Vec3f::Ones());
        // UsdLux, normalised: a sphere's intensity is four times what a surface at 1 m gets, a sun's is what it gets.
        // Ours is that over pi.
        const float power = (directional ? 1 : 4) * std::numbers::pi_v<float>;
        const std::string in = indent(depth), more = indent(depth + 1);
        text_ += fmt::format("{}def {} \"{}\"", in, directional ? "DistantLight" : "SphereLight",
                             uniqueName(name.empty() ? "light" : name, taken));
        if (spot) text_ += fmt::format(" (\n{}prepend apiSchemas = [\"ShapingAPI\"]\n{})", more, in);
        text_ += fmt::format("\n{}{{\n{}color3f inputs:color = {}\n{}float inputs:intensity = {}\n", in, more,
                             tuple(color), more, light.on ? strongest * power : 0.0f);
        text_ += fmt::format("{}bool inputs:normalize = 1\n", more);
        if (!directional) text_ += fmt::format("{}bool treatAsPoint = 1\n{}float inputs:radius = 0.01\n", more, more);
        if (spot)
            text_ += fmt::format("{}float inputs:shaping:cone:angle = {}\n{}float inputs:shaping:cone:softness = {}\n",
                                 more, light.outerAngle * 180 / std::numbers::pi_v<float>, more,
                                 light.outerAngle > 0 ? 1 - light.innerAngle / light.outerAngle : 0.0f);
        if (!directional && light.attenuation != Vec3f(0, 0, 1))
            leaving_.notes.add("lights weaken with the square of the distance: their own falloff is left out", node.id);
        if (!directional && light.range > 0) leaving_.notes.add("ranges of lights are left out", node.id);
        if (light.scope) leaving_.notes.add("lights shine on everything: what they are for is left out", node.id);
        text_ += in + "}\n";
    }

    /// The name of a material.
    std::string look(ObjectId id, ObjectId node) {
        const auto [known, isNew] = materials_.try_emplace(id, fmt::format("material_{}", materials_.size()));
        if (!isNew) return known->second;
        const Material m = materialOf(leaving_.scene, id);
        const std::string here = fmt::format("/{}/Looks/{}", top_, known->second);
        const std::string in = indent(4);
        std::string shaders;
        std::string surface = fmt::format("{}uniform token info:id = \"UsdPreviewSurface\"\n", in);
        const auto input = [&](std::string_view type, std::string_view name, ObjectId image, std::string_view channel,
                               const std::string& value, const std::string& scale, const std::string& bias) {
            if (!image || !addTexture(here, name, channel, image, scale, bias, node, shaders)) {
                if (!value.empty()) surface += fmt::format("{}{} inputs:{} = {}\n", in, type, name, value);
                return;
            }
            surface +=
                fmt::format("{}{} inputs:{}.connect = <{}/{}.outputs:{}>\n", in, type, name, here, name, channel);
        };
        const Vec3f base = m.baseColor.head<3>();
        const auto four = [](const Vec3f& c, float a) { return fmt::format("({}, {}, {}, {})", c[0], c[1], c[2], a); };
        input("color3f", m.unlit ? "emissiveColor" : "diffuseColor", m.baseColorImage, "rgb", tuple(base),
              four(base, m.baseColor[3]), {});
        if (m.unlit) surface += fmt::format("{}color3f inputs:diffuseColor = (0, 0, 0)\n", in);
        if (!m.unlit)
            input("color3f", "emissiveColor", m.emissiveImage, "rgb", tuple(m.emissive), four(m.emissive, 1), {});
        const std::string scale = fmt::format("(1, {}, {}, 1)", m.roughness, m.metallic);
        input("float", "roughness", m.metallicRoughnessImage, "g", fmt::format("{}", m.roughness), scale, {});
        input("float", "metallic", m.metallicRoughnessImage, "b", fmt::format("{}", m.metallic), scale, {});
        input("float", "occlusion", m.occlusionImage, "r", {}, "(1, 1, 1, 1)", {});
        // From -1 to 1; green goes the other way from below.
        input("normal3f", "normal", m.normalImage, "rgb", {}, "(2, 2, 2, 1)", "(-1, -1, -1, 0)");
        const bool blends =
            m.alphaMode == Material::kBlend || (m.alphaMode == Material::kAutoAlpha && m.baseColor[3] < 1);
        if (blends || m.alphaMode == Material::kMask)
            input("float", "opacity", m.baseColorImage, "a", fmt::format("{}", m.baseColor[3]),
                  four(base, m.baseColor[3]), {});
        if (m.alphaMode == Material::kMask)
            surface += fmt::format("{}float inputs:opacityThreshold = {}\n", in, m.alphaCutoff);
        surface += fmt::format(
            "{}float inputs:clearcoat = {}\n{}float inputs:clearcoatRoughness = {}\n"
            "{}float inputs:ior = {}\n{}token outputs:surface\n",
            in, m.clearcoat, in, m.clearcoatRoughness, in, m.ior, in);
        if (m.transmission > 0) leaving_.notes.add("light that goes through materials is left out", node);
        if (!m.layers.empty() || m.program || !m.passes.empty())
            leaving_.notes.add("layers, passes and programs of materials are left out", node);
        if (!shaders.empty())
            for (const char* set : {"st", "st1"})
                if (shaders.find(fmt::format("/{}.outputs:result>", set)) != std::string::npos)
                    shaders += fmt::format(
                        "            def Shader \"{}\"\n            {{\n{}uniform token info:id = "
                        "\"UsdPrimvarReader_float2\"\n{}string inputs:varname = \"{}\"\n"
                        "{}float2 outputs:result\n            }}\n",
                        set, in, in, set, in);
        looks_ += fmt::format(
            "        def Material \"{}\"\n        {{\n            token outputs:surface.connect = "
            "<{}/surface.outputs:surface>\n            def Shader \"surface\"\n            {{\n{}"
            "            }}\n{}        }}\n",
            known->second, here, surface, shaders);
        return known->second;
    }

    bool addTexture(const std::string& material, std::string_view name, std::string_view channel, ObjectId id,
                    const std::string& scale, const std::string& bias, ObjectId node, std::string& shaders) {
        const auto* image = leaving_.scene.get<Image>(id);
        const std::string file = image ? picture(*image, node) : std::string();
        if (file.empty()) return false;
        const auto wrap = [](std::int64_t how) {
            return how == Image::kClamp ? "clamp" : how == Image::kMirror ? "mirror" : "repeat";
        };
        const std::string in = indent(4);
        const char* set = image->texcoordSet == 1 ? "st1" : "st";
        std::string from = fmt::format("<{}/{}.outputs:result>", material, set);
        if (isPlaced(*image)) {
            // Ours count v from above: 1 - v goes in, and comes out.
            const float c = std::cos(image->rotation), s = std::sin(image->rotation);
            const Vec2f at(image->offset[0] + s * image->scale[1], 1 - image->offset[1] - c * image->scale[1]);
            shaders += fmt::format(
                "            def Shader \"{}_place\"\n            {{\n{}uniform token info:id = \"UsdTransform2d\"\n"
                "{}float2 inputs:in.connect = {}\n{}float inputs:rotation = {}\n{}float2 inputs:scale = ({}, {})\n"
                "{}float2 inputs:translation = ({}, {})\n{}float2 outputs:result\n            }}\n",
                name, in, in, from, in, image->rotation * 180 / std::numbers::pi_v<float>, in, image->scale[0],
                image->scale[1], in, at[0], at[1], in);
            from = fmt::format("<{}/{}_place.outputs:result>", material, name);
        }
        shaders += fmt::format(
            "            def Shader \"{}\"\n            {{\n{}uniform token info:id = \"UsdUVTexture\"\n"
            "{}asset inputs:file = @{}@\n{}float2 inputs:st.connect = {}\n"
            "{}token inputs:wrapS = \"{}\"\n{}token inputs:wrapT = \"{}\"\n",
            name, in, in, file, in, from, in, wrap(image->wrapU), in, wrap(image->wrapV));
        shaders += fmt::format("{}float4 inputs:scale = {}\n", in, scale);
        if (!bias.empty()) shaders += fmt::format("{}float4 inputs:bias = {}\n", in, bias);
        const bool color = channel == "rgb" && bias.empty();
        shaders +=
            fmt::format("{}token inputs:sourceColorSpace = \"{}\"\n{}{} outputs:{}\n            }}\n", in,
                        color || channel == "a" ? "sRGB" : "raw", in, channel == "rgb" ? "float3" : "float", channel);
        return true;
    }

    std::string picture(const Image& image, ObjectId node) {
        if (image.pixels.empty()) return {};
        const auto [known, isNew] = pictures_.try_emplace(image.pixels.id(), std::string());
        if (!isNew) return known->second;
        std::optional<Bytes> png = pngOf(image, leaving_.notes, node);
        if (!png) return {};
        return known->second = companions_.addPicture(std::move(*png), files_);
    }

    const LeavingScene& leaving_;
    Companions companions_;
    std::string top_;
    PlannedTree tree_;
    LeavingMeshes meshes_;
    LeavingFiles files_;
    std::map<int, std::vector<NodeTrack>> tracks_;
    double end_ = 0;  ///< s
    std::map<ObjectId, std::size_t> uses_;
    std::map<ObjectId, std::string> known_, materials_;
    std::map<BlobId, std::string> pictures_;
    std::string shapes_, looks_, text_;
};

}  // namespace

Expected<LeavingFiles> writeUsda(const LeavingScene& leaving) {
    return UsdaWriter(leaving).run();
}

}  // namespace tessera
