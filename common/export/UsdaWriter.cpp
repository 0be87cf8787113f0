// A scene as USD in text: prims of nodes and what they bear, time samples; looks and shapes in files of their own.
//
// A node that bears one thing and nothing else is one prim, as our importer makes one node of that. So what was read
// and written again has the same nodes.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "common/base/WrittenByTessera.h"
#include "common/cores/Skin.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/Drawable.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/LeavingMeshes.h"
#include "common/export/NodeTracks.h"
#include "common/export/PlannedTree.h"
#include "common/export/UniqueNames.h"
#include "common/export/UsdaLooks.h"
#include "common/export/UsdaShapes.h"
#include "common/export/UsdaText.h"
#include "common/export/WorldMeshes.h"
#include "common/field/LightSource.h"
#include "common/geometry/MeshCopies.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

class UsdaWriter {
public:
    explicit UsdaWriter(const LeavingScene& leaving)
        : leaving_(leaving),
          companions_(leaving.path),
          top_(usdIdentifier(std::filesystem::path(leaving.path).stem().string())),
          tree_(planTree(leaving.scene, leaving.selection, leaving.notes)),
          meshes_(leaving.scene, leaving.options.tolerance, leaving.notes),
          drawn_(leaving.scene, 0, leaving.notes),
          looks_(leaving, fmt::format("/{}/Looks", top_)),
          place_('/' + top_) {}

    Expected<LeavingFiles> run() {
        if (!leaving_.options.still) gatherMotion();
        for (const PlannedNode& node : tree_.nodes)
            for (const std::size_t shape : node.shapes) ++uses_[selected(shape).node->core];
        UniqueNames taken("_");
        taken.take("Looks");
        for (const int top : tree_.tops)
            if (Expected<void> done = addNode(top, 1, taken); !done) return tl::unexpected(done.error());
        std::string head = fmt::format("#usda 1.0\n# {}\n(\n", companions_.mark());
        head += fmt::format("    customLayerData = {{\n        string creator = {}\n    }}\n", usdQuoted(kWriterName));
        head += fmt::format("    defaultPrim = \"{}\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n", top_);
        if (!tracks_.empty())
            head += fmt::format(
                "    startTimeCode = 0\n    endTimeCode = {}\n    timeCodesPerSecond = {}\n"
                "    framesPerSecond = {}\n",
                end_ * kCodesPerSecond, kCodesPerSecond, kCodesPerSecond);
        head += fmt::format(")\n\ndef Xform \"{}\" (\n    kind = \"assembly\"\n)\n{{\n", top_);
        if (!looks_.text().empty()) head += "    def Scope \"Looks\"\n    {\n" + looks_.text() + "    }\n";
        const std::uint64_t bytes = head.size() + text_.size() + 2;
        if (Expected<void> fits = checkFileBytes(bytes, leaving_.options); !fits) return tl::unexpected(fits.error());
        files_.files.push_back(
            {.path = leaving_.path,
             .parts = {sliceOfText(std::move(head)), sliceOfText(std::move(text_)), sliceOfText("}\n")}});
        return std::move(files_);
    }

private:
    static constexpr double kCodesPerSecond = 60;
    /// Of text that says again what stands before: programs that follow no references show shared shapes, too.
    static constexpr std::size_t kMostRepeatedBytes = std::size_t{16} << 20;

    [[nodiscard]] const SelectedNode& selected(std::size_t index) const { return leaving_.selection.nodes[index]; }

    /// The head of a prim, and its opening brace. `more`: lines of metadata. `says`: its name whatever it is, as what
    /// it refers to may say another one.
    void open(std::string_view type, std::string_view name, std::size_t depth, UniqueNames& siblings,
              std::string_view more = {}, bool says = false) {
        const std::string own = siblings.take(usdIdentifier(name)), in = usdIndent(depth);
        place_ += '/' + own;
        ++files_.nodes;
        text_ += fmt::format("{}def {} \"{}\"", in, type, own);
        std::string said(more);
        if (says || (own != name && !name.empty()))
            said += fmt::format("{}displayName = {}\n", usdIndent(depth + 1), usdQuoted(name));
        if (!said.empty()) text_ += fmt::format(" (\n{}{})", said, in);
        text_ += fmt::format("\n{}{{\n", in);
    }
    void close(std::size_t depth) {
        text_ += usdIndent(depth) + "}\n";
        place_.erase(place_.rfind('/'));
    }

    void gatherMotion() {
        NodeTracks all = nodeTracks(leaving_.scene, leaving_.selection, tree_, leaving_.notes);
        for (const NodeClock& clock : all.clocks) end_ = std::max(end_, clock.playing.length);
        for (const NodeClock& clock : all.clocks) {
            noteLostPlaying(clock.playing, leaving_.notes, clock.node);
            // Our importer calls the only one so.
            if (all.clocks.size() > 1 || (!clock.name.empty() && clock.name != "animation"))
                leaving_.notes.add("animations are one in the file, without their names", clock.node);
            // All play by one time: a shorter one waits at its end for the longest before it begins again.
            const bool isShort = clock.playing.length > 0 && clock.playing.length < end_ * (1 - 1e-6);
            if (isShort && clock.playing.mode == Animation::kLoop && !clock.playing.paused)
                leaving_.notes.add("animations begin again together, when the longest ends", clock.node);
        }
        for (NodeTrack& track : all.tracks) {
            end_ = std::max(end_, track.times.back());
            tracks_[track.node].push_back(std::move(track));
        }
    }

    Expected<void> addNode(int index, std::size_t depth, UniqueNames& siblings) {
        const PlannedNode& node = tree_.nodes[static_cast<std::size_t>(index)];
        if (node.isLeaf()) {
            // Such cores place nothing, so the node stands where its parent does.
            if (node.bearsItself(node.shapes) || node.bearsItself(node.glyphs)) {
                const Expected<bool> shown = node.glyphs ? addGlyphs(selected(*node.glyphs), depth, siblings)
                                                         : addShape(selected(node.shapes.front()), depth, siblings);
                if (!shown) return tl::unexpected(shown.error());
                if (*shown) return {};
            }
            if (node.bearsItself(node.light)) {
                addLight(selected(*node.light), node.name, depth, siblings);
                return {};
            }
            if (node.camera && !node.light && node.shapes.empty() && !node.glyphs) {
                addCamera(node, node.name, index, depth, siblings);
                return {};
            }
        }
        open("Xform", node.name, depth, siblings);
        addPlace(index, node, usdIndent(depth + 1));
        UniqueNames taken("_");
        for (const std::size_t shape : node.shapes)
            if (Expected<bool> done = addShape(selected(shape), depth + 1, taken); !done)
                return tl::unexpected(done.error());
        if (node.glyphs)
            if (Expected<bool> done = addGlyphs(selected(*node.glyphs), depth + 1, taken); !done)
                return tl::unexpected(done.error());
        if (node.light) addLight(selected(*node.light), node.lightName, depth + 1, taken);
        if (node.camera) addCamera(node, node.cameraName, -1, depth + 1, taken);
        for (const int child : node.children)
            if (Expected<void> done = addNode(child, depth + 1, taken); !done) return done;
        close(depth);
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
            {"translation", "translate", "double3", usdTuple(node.translation), node.translation != Vec3d::Zero()},
            {"rotation", "orient", "quatd", fmt::format("({}, {}, {}, {})", q.w(), q.x(), q.y(), q.z()),
             std::abs(q.w()) < 1},
            {"scale", "scale", "double3", usdTuple(node.scale), node.scale != Vec3d::Ones()}};
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

    /// The first time in full. The next ones say the same again, or refer to the first where that would be too long.
    /// False: there is nothing to be seen.
    Expected<bool> addShape(const SelectedNode& node, std::size_t depth, UniqueNames& siblings) {
        const bool asItIs = node.core.is<SubdivisionSurface>();
        if (asItIs && leaving_.options.tolerance > 0)
            leaving_.notes.add("subdivision surfaces are written as they are, whatever the tolerance", node.id);
        const Expected<MeshArrays> arrays = (asItIs ? drawn_ : meshes_).of(node);
        if (!arrays) return tl::unexpected(arrays.error());
        if (arrays->positions.empty()) return false;
        if (node.core.is<Skin>()) leaving_.notes.add("skins stand still", node.id);
        files_.triangles += arrays->indices.sizeBytes() / (3 * sizeof(std::uint32_t));
        const std::string more = usdIndent(depth + 1);
        const ObjectId core = node.node->core;
        const ObjectId material = node.materialFor(drawableOf(node.core).material());
        // What is referred to says whether it has a look: so that has to be the same.
        const bool looks = material || arrays->kind == MeshKind::kTriangles;
        const auto [known, isNew] = known_.try_emplace({core, looks}, Written());
        std::string said;
        if (isNew || !known->second.text.empty()) {
            said = isNew ? usdShape(node, *arrays, kShapeIndent, leaving_.notes) : known->second.text;
            if (!isNew && said.size() > repeatable_) said.clear();
            if (!isNew) repeatable_ -= said.size();
            if (isNew && uses_[core] > 1 && said.size() <= repeatable_) known->second.text = said;
        }
        std::string metadata = fmt::format("{}prepend apiSchemas = [\"MaterialBindingAPI\"]\n", more);
        if (said.empty()) {
            leaving_.notes.add("shared meshes are references, which some programs do not follow", node.id);
            metadata += fmt::format("{}prepend references = <{}>\n", more, known->second.path);
        }
        open(usdShapeType(*arrays), node.node->name, depth, siblings, metadata, said.empty());
        if (isNew) known->second.path = place_;
        text_ += said;
        if (looks) {
            text_ += fmt::format("{}rel material:binding = <{}>\n", more,
                                 looks_.path(material, node.id, companions_, files_));
            text_ += fmt::format("{}uniform bool doubleSided = {}\n", more,
                                 materialOf(leaving_.scene, material).doubleSided ? 1 : 0);
        }
        close(depth);
        return true;
    }

    Expected<bool> addGlyphs(const SelectedNode& node, std::size_t depth, UniqueNames& siblings) {
        const Expected<MeshArrays> arrays = meshes_.of(node);
        if (!arrays) return tl::unexpected(arrays.error());
        const std::span<const MeshCopy> copies = arrays->copies.as<MeshCopy>();
        const std::span<const std::uint8_t> bytes = arrays->colors.as<std::uint8_t>();
        std::vector<float> places, turns, scales, colors;
        for (std::size_t i = 0; i < copies.size(); ++i) {
            const MeshCopy& copy = copies[i];
            if (!(copy.width > 0) || !(copy.length > 0)) continue;
            for (std::size_t k = 0; k < 3 && !bytes.empty(); ++k)
                colors.push_back(linearOfSrgb(static_cast<float>(bytes[4 * i + k]) / 255));
            places.insert(places.end(), copy.place.begin(), copy.place.end());
            turns.insert(turns.end(), {copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]});
            scales.insert(scales.end(), {copy.width, copy.length, copy.width});
        }
        if (places.empty()) return false;
        files_.triangles += places.size() / 3 * (arrays->indices.sizeBytes() / (3 * sizeof(std::uint32_t)));
        const std::string in = usdIndent(depth + 1);
        open("PointInstancer", node.node->name, depth, siblings);
        text_ += fmt::format("{}rel prototypes = <shape>\n{}int[] protoIndices = {}\n", in, in,
                             usdList(std::vector<int>(places.size() / 3, 0)));
        text_ += fmt::format("{}point3f[] positions = {}\n{}quath[] orientations = {}\n{}float3[] scales = {}\n", in,
                             usdTuples(places, 3), in, usdTuples(turns, 4), in, usdTuples(scales, 3));
        if (!colors.empty())
            text_ += fmt::format("{}color3f[] primvars:displayColor = {} (\n{}    interpolation = \"vertex\"\n{})\n",
                                 in, usdTuples(colors, 3), in, in);
        UniqueNames below("_");
        open("Mesh", "shape", depth + 1, below,
             usdIndent(depth + 2) + "prepend apiSchemas = [\"MaterialBindingAPI\"]\n");
        text_ += usdShape(node, *arrays, usdIndent(depth + 2), leaving_.notes);
        const ObjectId material = node.materialFor(drawableOf(node.core).material());
        text_ += fmt::format("{}rel material:binding = <{}>\n", usdIndent(depth + 2),
                             looks_.path(material, node.id, companions_, files_));
        text_ += fmt::format("{}uniform bool doubleSided = {}\n", usdIndent(depth + 2),
                             materialOf(leaving_.scene, material).doubleSided ? 1 : 0);
        close(depth + 1);
        close(depth);
        return true;
    }

    void addCamera(const PlannedNode& node, const std::string& name, int placed, std::size_t depth,
                   UniqueNames& siblings) {
        const std::string in = usdIndent(depth + 1);
        open("Camera", name, depth, siblings);
        if (placed >= 0) addPlace(placed, node, in);
        text_ += fmt::format(
            "{}float focalLength = {}\n{}float verticalAperture = 24\n{}float horizontalAperture = {}\n"
            "{}float2 clippingRange = (0.01, 100000)\n",
            in, 12 / std::tan(0.5 * node.yfov), in, in, 24.0 * 16 / 9, in);
        close(depth);
    }

    void addLight(const SelectedNode& node, const std::string& name, std::size_t depth, UniqueNames& siblings) {
        const LightSource light = node.core.info().light(node.core.data());
        const bool directional = light.kind == LightSource::Kind::kDirectional;
        const bool spot = light.kind == LightSource::Kind::kSpot;
        const float strongest = std::max(light.radiance.maxCoeff(), 0.0f);
        const Vec3f color = strongest > 0 ? Vec3f(light.radiance / strongest) : Vec3f(Vec3f::Ones());
        // UsdLux, normalised: a sphere's intensity is four times what a surface at 1 m gets, a sun's is what it gets.
        // Ours is that over pi.
        const float power = (directional ? 1 : 4) * std::numbers::pi_v<float>;
        const std::string in = usdIndent(depth + 1);
        open(directional ? "DistantLight" : "SphereLight", name.empty() ? "light" : name, depth, siblings,
             fmt::format("{}prepend apiSchemas = [{}\"ShadowAPI\"]\n", in, spot ? "\"ShapingAPI\", " : ""));
        text_ += fmt::format("{}color3f inputs:color = {}\n{}float inputs:intensity = {}\n", in, usdTuple(color), in,
                             light.on ? strongest * power : 0.0f);
        text_ += fmt::format("{}bool inputs:normalize = 1\n{}bool inputs:shadow:enable = {}\n", in, in,
                             light.shadows ? 1 : 0);
        if (!directional) text_ += fmt::format("{}bool treatAsPoint = 1\n{}float inputs:radius = 0.01\n", in, in);
        if (spot)
            text_ += fmt::format("{}float inputs:shaping:cone:angle = {}\n{}float inputs:shaping:cone:softness = {}\n",
                                 in, light.outerAngle * 180 / std::numbers::pi_v<float>, in,
                                 light.outerAngle > 0 ? 1 - light.innerAngle / light.outerAngle : 0.0f);
        if (!light.on) leaving_.notes.add("lights that are off have no intensity", node.id);
        if (!directional && light.attenuation != Vec3f(0, 0, 1))
            leaving_.notes.add("lights weaken with the square of the distance: their own falloff is left out", node.id);
        if (!directional && light.range > 0) leaving_.notes.add("ranges of lights are left out", node.id);
        if (light.scope) leaving_.notes.add("lights shine on everything: what they are for is left out", node.id);
        close(depth);
    }

    struct Written {
        std::string path;
        std::string text;  ///< as it may be repeated; empty: it is too long, or stands once
    };
    /// Of all shapes, wherever they stand: what is repeated is the same text.
    static constexpr const char* kShapeIndent = "    ";

    const LeavingScene& leaving_;
    Companions companions_;
    std::string top_;
    PlannedTree tree_;
    LeavingMeshes meshes_;
    LeavingMeshes drawn_;  ///< without a tolerance
    UsdaLooks looks_;
    LeavingFiles files_;
    std::map<int, std::vector<NodeTrack>> tracks_;
    double end_ = 0;  ///< s
    std::map<ObjectId, std::size_t> uses_;
    std::map<std::pair<ObjectId, bool>, Written> known_;
    std::size_t repeatable_ = kMostRepeatedBytes;
    std::string place_;  ///< the path of the prim that is written
    std::string text_;
};

}  // namespace

Expected<LeavingFiles> writeUsda(const LeavingScene& leaving) {
    return UsdaWriter(leaving).run();
}

}  // namespace tessera
