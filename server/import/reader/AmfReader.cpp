// AMF: objects of volumes, and constellations that place them; as XML, or in a zip archive.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "server/import/reader/CountedNotes.h"
#include "server/import/reader/MappedFile.h"
#include "server/import/reader/PlaceTable.h"
#include "server/import/reader/PrintedMesh.h"
#include "server/import/reader/PrintedNodes.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/printing/AmfModel.h"
#include "server/import/reader/printing/ZipArchive.h"

namespace tessera {
namespace {

class AmfReader {
public:
    explicit AmfReader(const ReadLimits& limits) : limits_(limits), nodes_(scene_, limits) {}

    Expected<PlainScene> read(const MappedFile& file) {
        AmfParser::Limits limits;
        limits.maxPlaces = std::min(limits.maxPlaces, limits_.maxNodes);
        const bool isArchive = file.text().starts_with("PK");
        limits.maxResources =
            std::min(limits.maxResources, mostPrintedResources(limits_, file.bytes().size(), isArchive));
        const PrintingRemark remark = [this](const std::string& what, const std::string& name, bool isMissing) {
            notes_.add(what, foreignName(name, ""), isMissing);
        };
        AmfParser parser(model_, remark, limits);
        if (file.text().starts_with("\x1f\x8b"))
            return fail(ErrorCode::kUnsupported,
                        "it is packed by gzip, and AMF is packed by zip or not at all: unpack it (gunzip) first");
        Expected<void> done = isArchive ? feedArchive(file, parser) : feedText(file, parser);
        if (done) done = parser.finish();
        if (!done && done.error().code != ErrorCode::kBadInput) return tl::unexpected(done.error());
        makeObjects();
        proto::scene::Node& root = nodes_.addRoot(model_.title.empty() ? "model" : model_.title, model_.unitMetres);
        if (Expected<void> placed = nodes_.place(topPlaces(), root); !placed) return tl::unexpected(placed.error());
        notes_.writeTo(scene_);
        if (scene_.file.mesh().empty()) {
            if (!done) return tl::unexpected(done.error());
            return fail(ErrorCode::kBadInput,
                        fmt::format("it has no triangles that can be shown{}{}", scene_.notes.empty() ? "" : ": ",
                                    scene_.notes.empty() ? "" : scene_.notes.front()));
        }
        if (!done) scene_.noteMissing(done.error().message + "; what comes before is shown");
        constexpr std::uint32_t kZUp = 3;  // proto/scene.proto
        scene_.file.set_up_axis(kZUp);
        return std::move(scene_);
    }

private:
    static Expected<void> feedText(const MappedFile& file, AmfParser& parser) {
        constexpr std::size_t kPiece = std::size_t{1} << 18;
        const ByteSpan all = file.bytes();
        for (std::size_t at = 0; at < all.size(); at += kPiece) {
            if (!parser.feed(all.subspan(at, std::min(kPiece, all.size() - at)))) break;
            file.passed(at);
        }
        return {};
    }
    static Expected<void> feedArchive(const MappedFile& file, AmfParser& parser) {
        Expected<ZipArchive> archive = ZipArchive::open(file.bytes());
        if (!archive) return tl::unexpected(archive.error());
        const ZipEntry* const entry = archive->firstWith(".amf");
        if (entry == nullptr)
            return fail(ErrorCode::kBadInput, "the archive has no file that ends in .amf: save it anew as AMF");
        return archive->unpack(*entry, [&](ByteSpan piece, std::size_t passed) {
            sayProgress(passed, entry->packed);
            return parser.feed(piece);
        });
    }

    void makeObjects() {
        for (AmfObject& object : model_.objects) {
            const std::string name = object.name.empty() ? numbered("object", object.id) : object.name;
            PrintedObject& made = nodes_.addObject(name);
            keepNumber(object.id, made);
            VertexChains chains;  // of one volume after the other: none costs as much as all vertices
            for (AmfVolume& volume : object.volumes) makeVolume(object, volume, chains, made);
            object.positions = {};
        }
        for (const AmfConstellation& constellation : model_.constellations)
            keepNumber(constellation.id,
                       nodes_.addObject(constellation.name.empty() ? numbered("constellation", constellation.id)
                                                                   : constellation.name));
        for (const AmfConstellation& constellation : model_.constellations) fill(constellation);
    }

    static std::string numbered(std::string_view kind, std::uint32_t id) {
        return id == kNoNumber ? std::string(kind) : fmt::format("{} {}", kind, id);
    }

    void keepNumber(std::uint32_t id, PrintedObject& object) {
        all_.push_back(&object);
        const bool isNew = numbers_.try_emplace(id, &object).second;
        if (!isNew && id != kNoNumber)
            notes_.add("two objects or constellations of one number: constellations place the first", object.name);
    }

    void makeVolume(const AmfObject& object, AmfVolume& volume, VertexChains& chains, PrintedObject& to) {
        const std::size_t vertices = object.positions.size() / 3;
        const auto material = model_.materials.find(volume.material);
        const std::string name = !volume.name.empty() ? volume.name
                                 : material != model_.materials.end() && !material->second.name.empty()
                                     ? material->second.name
                                     : "volume";
        if (volume.material != kNoNumber && material == model_.materials.end())
            notes_.add("materials that do not exist: their volumes have none", std::to_string(volume.material));
        // From the inside out: of the triangle, the vertex, the volume, the object, the material.
        const std::optional<AmfColor> ofMaterial =
            material == model_.materials.end() ? std::nullopt : material->second.color;
        const std::optional<AmfColor> ofAll = volume.color ? volume.color : object.color ? object.color : ofMaterial;
        const bool hasCorners = !object.colors.empty() || !volume.colors.empty();
        PrintedMesh mesh;
        mesh.indices = std::move(volume.indices);
        volume.colors.resize(volume.colors.empty() ? 0 : mesh.indices.size() / 3);
        constexpr AmfColor kWhite = 0xffffffff;
        for (std::size_t corner = 0; hasCorners && corner < mesh.indices.size(); ++corner) {
            const std::uint32_t vertex = mesh.indices[corner];
            AmfColor color = ofAll.value_or(kWhite);
            if (vertex < object.colors.size() && object.colors[vertex]) color = *object.colors[vertex];
            if (!volume.colors.empty() && volume.colors[corner / 3]) color = *volume.colors[corner / 3];
            mesh.colors.push_back(color);
        }
        // The vertices that are its own.
        std::vector<std::uint32_t> sources;
        for (std::uint32_t& corner : mesh.indices) {
            if (corner >= vertices) continue;
            const std::uint32_t source = corner;
            corner = chains.vertexAt(source, [](std::uint32_t) { return true; });
            if (corner < sources.size()) continue;
            sources.push_back(source);
            const auto* const xyz = &object.positions[3 * std::size_t{source}];
            mesh.positions.insert(mesh.positions.end(), xyz, xyz + 3);
        }
        chains.clear(sources);
        if (const std::string leftOut = leaveOutUnsound(mesh, to.name); !leftOut.empty()) scene_.noteMissing(leftOut);
        const bool isOneColor =
            std::ranges::all_of(mesh.colors, [&](AmfColor color) { return color == mesh.colors.front(); });
        std::optional<AmfColor> color = ofAll;
        if (isOneColor && !mesh.colors.empty()) {
            color = mesh.colors.front();
            mesh.colors.clear();
        }
        const std::string look =
            !mesh.colors.empty()
                ? cornersMaterial(std::ranges::any_of(mesh.colors, [](AmfColor c) { return (c & 0xff) != 0xff; }))
                : colorMaterial(color,
                                material == model_.materials.end() || color != ofMaterial ? "" : material->second.name);
        constexpr PrintedLook kLook{.hasColors = true};
        for (PrintedPart& part : partedByLooks(std::move(mesh), std::span(&kLook, 1), !limits_.verbatim))
            nodes_.addMesh(to, foreignName(name, "volume"), std::move(part.mesh), look);
    }

    std::string cornersMaterial(bool isTranslucent) {
        std::string& name = cornersMaterials_[isTranslucent ? 1 : 0];
        if (name.empty())
            name = nodes_.addMaterial(
                {.name = isTranslucent ? "colours, translucent" : "colours", .isTranslucent = isTranslucent});
        return name;
    }
    /// Empty: nothing is said.
    std::string colorMaterial(const std::optional<AmfColor>& color, const std::string& named) {
        if (!color) return {};
        std::string& name = colorMaterials_[{*color, named}];
        if (name.empty())
            name = nodes_.addMaterial({.name = named.empty() ? fmt::format("#{:08X}", *color) : named,
                                       .color = *color,
                                       .isTranslucent = (*color & 0xff) != 0xff});
        return name;
    }

    void fill(const AmfConstellation& constellation) {
        PrintedObject* const made = all_[model_.objects.size() + filled_++];
        for (const AmfInstance& instance : constellation.instances) {
            const auto object = numbers_.find(instance.object);
            if (object == numbers_.end() || instance.object == kNoNumber) {
                notes_.add("objects that do not exist are placed, and left out",
                           instance.object == kNoNumber ? std::string() : std::to_string(instance.object), true);
                continue;
            }
            Affine3d map = Affine3d::Identity();
            const auto turn = [&](std::size_t axis) {
                return Eigen::AngleAxisd(instance.rotation[axis] * std::numbers::pi / 180,
                                         Vec3d::Unit(static_cast<Eigen::Index>(axis)));
            };
            map.linear() = (turn(2) * turn(1) * turn(0)).toRotationMatrix();
            map.translation() = Vec3d(instance.delta[0], instance.delta[1], instance.delta[2]);
            constexpr double kFarthest = 1e12;
            if (!isRegular(map) || !(map.translation().cwiseAbs().maxCoeff() < kFarthest)) {
                notes_.add("instances whose place is no number are left out", object->second->name, true);
                continue;
            }
            made->places.push_back({object->second->name, object->second, map});
        }
    }

    /// What is in no constellation stands where it is.
    std::vector<PrintedPlace> topPlaces() {
        std::vector<PrintedPlace> places;
        for (PrintedObject* const object : all_) places.push_back({object->name, object, Affine3d::Identity()});
        PrintedNodes::dropPlacedElsewhere(places);
        return places;
    }

    const ReadLimits& limits_;
    PlainScene scene_;
    PrintedNodes nodes_;
    CountedNotes notes_;
    AmfModel model_;
    std::vector<PrintedObject*> all_;  ///< objects, then constellations, in the order of the file
    std::map<std::uint32_t, PrintedObject*> numbers_;
    std::array<std::string, 2> cornersMaterials_;
    std::map<std::pair<AmfColor, std::string>, std::string> colorMaterials_;
    std::size_t filled_ = 0;
};

}  // namespace

Expected<PlainScene> readAmf(const std::string& path, const ReadLimits& limits) {
    const Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    return AmfReader(limits).read(*file);
}

}  // namespace tessera
