// A scene as VRML 2.0 (ISO/IEC 14772-1): Transforms, Shapes by DEF and USE, lights, viewpoints, interpolators.
//
// A node that bears one thing and nothing else is that thing, as our importer makes one node of it. A WorldInfo lists
// names that are no identifiers of VRML: "n_1st=1st".

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "common/base/WrittenByTessera.h"
#include "common/cores/Material.h"
#include "common/cores/Skin.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/LeavingLooks.h"
#include "common/export/LeavingMeshes.h"
#include "common/export/LeavingPictures.h"
#include "common/export/NodeTracks.h"
#include "common/export/PlannedTree.h"
#include "common/export/UniqueNames.h"
#include "common/export/WorldMeshes.h"
#include "common/field/LightSource.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

std::string vrmlQuoted(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') quoted += '\\';
        quoted += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return quoted += '"';
}

std::string vrmlNumbers(std::span<const float> values, std::size_t each) {
    std::string text = "[";
    auto to = std::back_inserter(text);
    for (std::size_t i = 0; i < values.size(); ++i)
        fmt::format_to(to, "{}{}",
                       i == 0          ? ""
                       : i % each == 0 ? ", "
                                       : " ",
                       std::isfinite(values[i]) ? values[i] : 0.0f);
    return text += ']';
}

/// "x y z angle"
std::string axisAndAngle(const Quatd& turn) {
    const Eigen::AngleAxisd a(turn.normalized());
    return fmt::format("{} {} {} {}", a.axis()[0], a.axis()[1], a.axis()[2], a.angle());
}

std::string three(const Vec3d& v) {
    return fmt::format("{} {} {}", v[0], v[1], v[2]);
}

std::string vrmlColor(const Vec3f& linear) {
    std::string text;
    for (int i = 0; i < 3; ++i)
        text += fmt::format("{}{}", i == 0 ? "" : " ", srgbOfLinear(std::clamp(linear[i], 0.0f, 1.0f)));
    return text;
}

class VrmlWriter {
public:
    explicit VrmlWriter(const LeavingScene& leaving)
        : leaving_(leaving),
          companions_(leaving.path),
          tree_(planTree(leaving.scene, leaving.selection, leaving.notes)),
          meshes_(leaving.scene, leaving.options.tolerance, leaving.notes) {}

    Expected<LeavingFiles> run() {
        if (!leaving_.options.still) motion_ = nodeTracks(leaving_.scene, leaving_.selection, tree_, leaving_.notes);
        placeMoments();
        for (const NodeTrack& track : motion_.tracks) moving_.insert(track.node);
        for (const PlannedNode& node : tree_.nodes)
            for (const std::size_t shape : node.shapes) ++uses_[selected(shape).node->core];
        for (const int top : tree_.tops)
            if (Expected<void> done = addNode(top, 0); !done) return tl::unexpected(done.error());
        addMotion();
        std::string head =
            fmt::format("#VRML V2.0 utf8\n# {}\nWorldInfo {{ info [ {}", companions_.mark(), vrmlQuoted(kWriterName));
        for (const std::string& name : otherNames_) head += ", " + vrmlQuoted(name);
        head += " ] }\n";
        if (Expected<void> fits = checkFileBytes(head.size() + text_.size(), leaving_.options); !fits)
            return tl::unexpected(fits.error());
        files_.files.push_back(
            {.path = leaving_.path, .parts = {sliceOfText(std::move(head)), sliceOfText(std::move(text_))}});
        return std::move(files_);
    }

private:
    /// Of images that are in a file with another tint already: so that many tints of one end. Small ones count as
    /// kLeastTintedPixels: each is a file.
    static constexpr std::size_t kMostTintedPixels = std::size_t{1} << 26, kLeastTintedPixels = std::size_t{1} << 16;

    [[nodiscard]] const SelectedNode& selected(std::size_t index) const { return leaving_.selection.nodes[index]; }
    static std::string indent(std::size_t depth) { return std::string(2 * depth, ' '); }

    /// VRML's identifiers, each once in a file, and none of the language's words.
    std::string uniqueName(std::string_view name) {
        std::string plain = "n_";  // of what begins as no identifier may, or is a word of VRML's
        for (const char c : name) {
            const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
            plain += good ? c : '_';
        }
        static const std::set<std::string, std::less<>> kWords = {
            "DEF",  "USE",   "PROTO", "EXTERNPROTO", "ROUTE",   "TO",       "IS",
            "TRUE", "FALSE", "NULL",  "field",       "eventIn", "eventOut", "exposedField"};
        const bool begins = !name.empty() && !(name.front() >= '0' && name.front() <= '9');
        if (begins && !kWords.contains(name)) plain.erase(0, 2);
        return unique_.take(plain);
    }

    /// "DEF name ", of what has this name; VRML's own, where that is another one, is listed.
    std::string def(const std::string& name) {
        ++files_.nodes;
        return fmt::format("DEF {} ", listedName(name));
    }
    std::string listedName(const std::string& name) {
        std::string own = uniqueName(name);
        if (own != name) otherNames_.push_back(fmt::format("{}={}", own, name));
        return own;
    }

    Expected<void> addNode(int index, std::size_t depth) {
        const PlannedNode& node = tree_.nodes[static_cast<std::size_t>(index)];
        const std::string in = indent(depth), more = indent(depth + 1);
        if (node.isLeaf()) {
            // Such cores place nothing, so the node stands where its parent does.
            if (node.bearsItself(node.shapes) || node.bearsItself(node.glyphs)) {
                const Expected<bool> shown =
                    addShape(selected(node.glyphs ? *node.glyphs : node.shapes.front()), depth);
                if (!shown) return tl::unexpected(shown.error());
                if (*shown) return {};
            }
            if (node.bearsItself(node.light)) {
                addLight(selected(*node.light), node.name, in);
                return {};
            }
            if (node.camera && !node.light && node.shapes.empty() && !node.glyphs && node.scale == Vec3d::Ones() &&
                !moving_.contains(index)) {
                addViewpoint(node, node.name, in, true);
                return {};
            }
        }
        const std::string called = def(node.name);
        names_.emplace(index, called.substr(4, called.size() - 5));
        text_ += fmt::format("{}{}Transform {{\n", in, called);
        if (node.translation != Vec3d::Zero()) text_ += more + "translation " + three(node.translation) + '\n';
        if (std::abs(node.rotation.w()) < 1) text_ += more + "rotation " + axisAndAngle(node.rotation) + '\n';
        if (node.scale != Vec3d::Ones()) text_ += more + "scale " + three(node.scale) + '\n';
        text_ += more + "children [\n";
        std::vector<std::size_t> shapes = node.shapes;
        if (node.glyphs) shapes.push_back(*node.glyphs);
        for (const std::size_t shape : shapes)
            if (Expected<bool> done = addShape(selected(shape), depth + 2); !done) return tl::unexpected(done.error());
        if (node.light) addLight(selected(*node.light), node.lightName, indent(depth + 2));
        if (node.camera) addViewpoint(node, node.cameraName, indent(depth + 2), false);
        for (const int child : node.children)
            if (Expected<void> done = addNode(child, depth + 2); !done) return done;
        text_ += fmt::format("{}]\n{}}}\n", more, in);
        return {};
    }

    /// `placed`: where the node stands; else in its parent, which stands there.
    void addViewpoint(const PlannedNode& node, const std::string& name, const std::string& in, bool placed) {
        text_ += fmt::format("{}{}Viewpoint {{ position {} orientation {} fieldOfView {} description {} }}\n", in,
                             def(name), three(placed ? node.translation : Vec3d(Vec3d::Zero())),
                             axisAndAngle(placed ? node.rotation : Quatd::Identity()), node.yfov, vrmlQuoted(name));
    }

    /// False: there is nothing to be seen.
    Expected<bool> addShape(const SelectedNode& node, std::size_t depth) {
        Expected<MeshArrays> arrays = meshes_.of(node);
        if (arrays && arrays->kind == MeshKind::kGlyphs) arrays = expandedCopies(*arrays);
        if (!arrays) return tl::unexpected(arrays.error());
        if (arrays->positions.empty()) return false;
        const bool triangles = arrays->kind == MeshKind::kTriangles;
        if (!triangles && arrays->kind != MeshKind::kLines && arrays->kind != MeshKind::kPoints) {
            leaving_.notes.add("particles are left out", node.id);
            return false;
        }
        if (node.core.is<Skin>()) leaving_.notes.add("skins stand still", node.id);
        files_.triangles += arrays->indices.sizeBytes() / (3 * sizeof(std::uint32_t));
        const std::string in = indent(depth), more = indent(depth + 1);
        const ObjectId material = node.materialFor(drawableOf(node.core).material());
        text_ += fmt::format("{}{}Shape {{\n", in, def(node.node->name.empty() ? "node" : node.node->name));
        if (material || triangles) text_ += more + "appearance " + appearance(material, *arrays, node.id, more) + '\n';
        const auto known = shapes_.find(node.node->core);
        if (known != shapes_.end()) {
            text_ += fmt::format("{}geometry USE {}\n{}}}\n", more, known->second, in);
            return true;
        }
        noteLostOpacities(arrays->colors.as<std::uint8_t>(), leaving_.notes, node.id);
        std::string called;
        if (uses_[node.node->core] > 1) {
            const std::string shape = uniqueName("shape");
            shapes_.emplace(node.node->core, shape);
            called = fmt::format("DEF {} ", shape);
        }
        text_ += fmt::format("{}geometry {}{}\n{}}}\n", more, called,
                             geometry(*arrays, materialOf(leaving_.scene, material), more), in);
        return true;
    }

    static std::string geometry(const MeshArrays& arrays, const Material& material, const std::string& in) {
        const std::string more = in + "  ";
        const bool points = arrays.kind == MeshKind::kPoints, lines = arrays.kind == MeshKind::kLines;
        std::string text = points ? "PointSet {\n" : lines ? "IndexedLineSet {\n" : "IndexedFaceSet {\n";
        text += fmt::format("{}coord Coordinate {{ point {} }}\n", more, vrmlNumbers(arrays.positions.as<float>(), 3));
        if (!arrays.colors.empty()) {
            std::vector<float> colors;
            const std::span<const std::uint8_t> bytes = arrays.colors.as<std::uint8_t>();
            for (std::size_t i = 0; i < bytes.size(); ++i)
                if (i % 4 != 3) colors.push_back(static_cast<float>(bytes[i]) / 255);
            text += fmt::format("{}color Color {{ color {} }}\n", more, vrmlNumbers(colors, 3));
        }
        if (points) return text + in + '}';
        if (!lines) {
            text += more + (material.doubleSided ? "solid FALSE\n" : "solid TRUE\n");
            if (!arrays.normals.empty())
                text +=
                    fmt::format("{}normal Normal {{ vector {} }}\n", more, vrmlNumbers(arrays.normals.as<float>(), 3));
            if (!arrays.texcoords.empty()) {
                std::vector<float> uv(arrays.texcoords.as<float>().begin(), arrays.texcoords.as<float>().end());
                for (std::size_t i = 1; i < uv.size(); i += 2) uv[i] = 1 - uv[i];  // from the lower left
                text += fmt::format("{}texCoord TextureCoordinate {{ point {} }}\n", more, vrmlNumbers(uv, 2));
            }
        }
        const std::span<const std::uint32_t> corners = (lines ? arrays.lines : arrays.indices).as<std::uint32_t>();
        const std::size_t each = lines ? 2 : 3;
        text += more + "coordIndex [";
        auto to = std::back_inserter(text);
        for (std::size_t i = 0; i + each <= corners.size(); i += each)
            fmt::format_to(to, "{}{},-1", i == 0 ? "" : ",",
                           fmt::join(corners.begin() + static_cast<std::ptrdiff_t>(i),
                                     corners.begin() + static_cast<std::ptrdiff_t>(i + each), ","));
        return text + "]\n" + in + '}';
    }

    std::string appearance(ObjectId id, const MeshArrays& arrays, ObjectId node, const std::string& in) {
        const bool mapped = !arrays.texcoords.empty(), unlit = arrays.kind != MeshKind::kTriangles;
        const auto [known, isNew] = looks_.try_emplace({id, mapped, unlit}, std::string());
        if (!isNew) return "USE " + known->second;
        known->second = uniqueName("look");
        const Material m = materialOf(leaving_.scene, id);
        const bool blends = m.alphaMode == Material::kBlend || m.alphaMode == Material::kAutoAlpha;
        noteLosses(m, node);
        const Vec3f base = m.baseColor.head<3>();
        // What pictures that stay behind say, as one value each.
        const auto meanOf = [&](ObjectId of, bool linear) {
            const auto* said = of ? leaving_.scene.get<Image>(of) : nullptr;
            return said ? meanColor(*said, linear) : Vec3f(Vec3f::Ones());
        };
        const Vec3f metalRough = meanOf(m.metallicRoughnessImage, false);
        const float metallic = m.metallic * metalRough[2], roughness = m.roughness * metalRough[1];
        const Vec3f emissive = m.emissive.cwiseProduct(meanOf(m.emissiveImage, true));
        const Vec3f mirrored = base.cwiseProduct(mapped ? meanOf(m.baseColorImage, true) : Vec3f(Vec3f::Ones()));
        if (std::max(emissive.maxCoeff(), base.maxCoeff()) > 1) leaving_.notes.add("colours above 1 are 1", node);
        const bool glows = unlit || m.unlit;
        const float opacity = blends ? m.baseColor[3] : 1.0f;
        const auto* image = m.baseColorImage ? leaving_.scene.get<Image>(m.baseColorImage) : nullptr;
        // Pictures of colours replace the material's, and those with an opacity its transparency.
        Vec4f tint = Vec4f::Ones();
        const auto share = [](float part) { return part > 0 ? std::min(part, 1.0f) : 0.0f; };
        if (image && !unlit) {
            tint.head<3>() = base.unaryExpr(share);
            if (opacity < 1 && !isOpaque(*image)) tint[3] = share(opacity);
        }
        const Vec4f wanted = tint;
        const std::string file = image && mapped ? picture(*image, tint, node) : std::string();
        const bool replaced = !file.empty() && !unlit && tint == wanted;
        const float transparency = replaced && wanted[3] != 1 ? 0.0f : 1 - opacity;
        const Vec3f color = replaced ? Vec3f(Vec3f::Ones()) : base;
        const bool phong = m.shading == Material::kPhong;
        const float mirrors = 0.04f + (1 - 0.04f) * metallic;
        const Vec3f highlight = glows   ? Vec3f(Vec3f::Zero())
                                : phong ? Vec3f(m.specular * m.specularColor)
                                        : Vec3f(mirrors * (metallic > 0.5f ? mirrored : Vec3f(Vec3f::Ones())));
        std::string text = fmt::format("DEF {} Appearance {{\n", known->second);
        // Without a material nothing lights the picture.
        if (!m.unlit || !replaced || transparency > 0) {
            text += fmt::format("{}  material Material {{ diffuseColor {} emissiveColor {} ", in,
                                glows ? "0 0 0" : vrmlColor(color), vrmlColor(glows ? color : emissive));
            text += fmt::format("specularColor {} shininess {} transparency {} }}\n", vrmlColor(highlight),
                                std::clamp(phong ? m.shininess / 128 : 1 - roughness, 0.01f, 1.0f), transparency);
        }
        if (!file.empty()) {
            const auto repeats = [](std::int64_t wrap) { return wrap == Image::kClamp ? "FALSE" : "TRUE"; };
            text += fmt::format("{}  texture ImageTexture {{ url {} repeatS {} repeatT {} }}\n", in, vrmlQuoted(file),
                                repeats(image->wrapU), repeats(image->wrapV));
            if (isPlaced(*image)) leaving_.notes.add("places of images on surfaces are left out", node);
        }
        if (m.normalImage || m.metallicRoughnessImage || m.emissiveImage || m.occlusionImage)
            leaving_.notes.add("images but those of colour are left out", node);
        return text + in + '}';
    }

    void noteLosses(const Material& m, ObjectId node) {
        ExportNotes& notes = leaving_.notes;
        Material lost = m;
        lost.shading = Material::kMetalRoughness;  // Phong's is VRML's own
        noteLostLooks(lost, notes, node);
        if (m.shading == Material::kPhong) return;
        if (m.metallic > 0) notes.add("metals are written as what mirrors their colour", node);
        if (m.clearcoat > 0) notes.add("clear coats are left out", node);
        if (m.transmission > 0) notes.add("light that goes through materials is left out", node);
        if (m.alphaMode == Material::kMask) notes.add("masks of opacity are left out", node);
        if (m.specular != 1 || m.specularColor != Vec3f::Ones() || m.ior != 1.5f)
            notes.add("how much what is no metal reflects, and how tinted, is left out", node);
    }

    static bool isOpaque(const Image& image) {
        if (image.encoding != Image::kSrgb || !image.pixels.resident()) return true;
        const std::span<const std::uint8_t> rgba = image.pixels.as<std::uint8_t>();
        for (std::size_t i = 3; i < rgba.size(); i += 4)
            if (rgba[i] != 255) return false;
        return true;
    }

    /// Its file. `tint` becomes white where there is no room for one more tint.
    std::string picture(const Image& image, Vec4f& tint, ObjectId node) {
        if (image.pixels.empty()) return {};
        const auto keyOf = [&] {
            return std::pair(image.pixels.id(), std::array<float, 4>{tint[0], tint[1], tint[2], tint[3]});
        };
        const std::size_t pixels = std::max(image.pixels.sizeBytes() / 4, kLeastTintedPixels);
        if (!pictures_.contains(keyOf()) && !drawn_.insert(image.pixels.id()).second && tint != Vec4f::Ones()) {
            if (pixels > tintable_) {
                leaving_.notes.add("tints are left out of images that have too many", node);
                tint.setOnes();
            } else {
                tintable_ -= pixels;
            }
        }
        const auto [known, isNew] = pictures_.try_emplace(keyOf(), std::string());
        if (!isNew) return known->second;
        std::optional<Bytes> png = pngOf(image, leaving_.notes, node, tint);
        if (!png) return {};
        return known->second = companions_.addPicture(std::move(*png), files_);
    }

    void addLight(const SelectedNode& node, const std::string& name, const std::string& in) {
        const LightSource light = node.core.info().light(node.core.data());
        const float strongest = std::max(light.radiance.maxCoeff(), 0.0f);
        if (strongest > 1) leaving_.notes.add("lights are as strong as VRML has them, 1 at most", node.id);
        const Vec3f color = strongest > 0 ? Vec3f(light.radiance / strongest) : Vec3f(Vec3f::Ones());
        const std::string common = fmt::format("on {} color {} intensity {}", light.on ? "TRUE" : "FALSE",
                                               vrmlColor(color), std::min(strongest, 1.0f));
        if (light.scope) leaving_.notes.add("lights shine on everything: what they are for is left out", node.id);
        if (light.shadows) leaving_.notes.add("which lights cast shadows is left out", node.id);
        const std::string called = def(name.empty() ? "light" : name);
        if (light.kind == LightSource::Kind::kDirectional) {
            leaving_.notes.add("directional lights shine on what is below their node alone", node.id);
            text_ += fmt::format("{}{}DirectionalLight {{ {} direction 0 0 -1 }}\n", in, called, common);
            return;
        }
        const std::string falls =
            fmt::format("{} attenuation {} {} {} radius {}", common, light.attenuation[0], light.attenuation[1],
                        light.attenuation[2], light.range > 0 ? light.range : 1e6f);
        if (light.kind == LightSource::Kind::kSpot)
            text_ += fmt::format("{}{}SpotLight {{ {} direction 0 0 -1 cutOffAngle {} beamWidth {} }}\n", in, called,
                                 falls, light.outerAngle, light.innerAngle);
        else
            text_ += fmt::format("{}{}PointLight {{ {} }}\n", in, called, falls);
    }

    /// What takes no time moves nothing: the node stands as the animation holds it, if it plays.
    void placeMoments() {
        std::erase_if(motion_.tracks, [&](const NodeTrack& track) {
            const NodeClock& clock = motion_.clocks[track.clock];
            if (clock.playing.length > 0) return false;
            leaving_.notes.add("animations that take no time are written as the places that they hold", clock.node);
            if (clock.playing.paused) return true;
            PlannedNode& node = tree_.nodes[static_cast<std::size_t>(track.node)];
            const std::array<double, 4>& v = track.values.back();
            if (track.field == "rotation")
                node.rotation = Quatd(v[0], v[1], v[2], v[3]).normalized();
            else
                (track.field == "scale" ? node.scale : node.translation) = Vec3d(v[0], v[1], v[2]);
            return true;
        });
    }

    /// A clock for each animation, and an interpolator for each property that moves. ROUTEs come behind the last node:
    /// some readers take none between nodes.
    void addMotion() {
        std::string routes;
        std::vector<std::string> clocks(motion_.clocks.size());
        for (const NodeTrack& track : motion_.tracks) {
            const auto moved = names_.find(track.node);
            const double cycle = motion_.clocks[track.clock].playing.length;
            if (moved == names_.end()) continue;
            std::string& clock = clocks[track.clock];
            if (clock.empty()) clock = addClock(motion_.clocks[track.clock]);
            const bool turns = track.field == "rotation";
            const std::string name = uniqueName(moved->second + "_" + track.field);
            std::string keys, values;
            for (std::size_t i = 0; i < track.times.size(); ++i) {
                const std::array<double, 4>& v = track.values[i];
                keys += fmt::format("{}{}", i == 0 ? "" : " ", std::clamp(track.times[i] / cycle, 0.0, 1.0));
                values += (i == 0 ? "" : ", ") + (turns ? axisAndAngle(Quatd(v[0], v[1], v[2], v[3]))
                                                        : fmt::format("{} {} {}", v[0], v[1], v[2]));
            }
            text_ += fmt::format("DEF {} {} {{ key [{}] keyValue [{}] }}\n", name,
                                 turns ? "OrientationInterpolator" : "PositionInterpolator", keys, values);
            routes += fmt::format("ROUTE {}.fraction_changed TO {}.set_fraction\nROUTE {}.value_changed TO {}.set_{}\n",
                                  clock, name, name, moved->second, track.field);
        }
        text_ += routes;
    }

    /// Its name.
    std::string addClock(const NodeClock& clock) {
        std::string name = clock.name.empty() ? uniqueName("Clock") : listedName(clock.name);
        const Playing& playing = clock.playing;
        const bool loops = playing.mode != Animation::kOnce, stands = playing.paused || clock.stands;
        if (!loops) leaving_.notes.add("animations that play once wait until an event begins them", clock.node);
        if (clock.stands)
            leaving_.notes.add("animations that take more than 1e9 s, or for ever, are paused", clock.node);
        text_ += fmt::format("DEF {} TimeSensor {{ cycleInterval {} loop {}{} }}\n", name,
                             std::min(playing.length, kLongestCycle), loops ? "TRUE" : "FALSE",
                             stands ? " enabled FALSE" : "");
        return name;
    }

    const LeavingScene& leaving_;
    Companions companions_;
    PlannedTree tree_;
    LeavingMeshes meshes_;
    LeavingFiles files_;
    NodeTracks motion_;
    std::map<ObjectId, std::size_t> uses_;
    std::map<ObjectId, std::string> shapes_;
    std::map<std::tuple<ObjectId, bool, bool>, std::string> looks_;
    std::map<std::pair<BlobId, std::array<float, 4>>, std::string> pictures_;  ///< by their tints
    std::set<BlobId> drawn_;                                                   ///< those in pictures_
    std::size_t tintable_ = kMostTintedPixels;
    std::map<int, std::string> names_;
    std::set<int> moving_;
    std::vector<std::string> otherNames_;  ///< "VRML's own=name"
    UniqueNames unique_{"_"};
    std::string text_;
};

}  // namespace

Expected<LeavingFiles> writeVrml(const LeavingScene& leaving) {
    return VrmlWriter(leaving).run();
}

}  // namespace tessera
