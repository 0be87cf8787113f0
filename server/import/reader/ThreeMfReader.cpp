// 3MF: a package's models, what its build places, shared objects as Definitions.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "common/math/Srgb.h"
#include "server/import/reader/CountedNotes.h"
#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/MappedFile.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PrintedMesh.h"
#include "server/import/reader/PrintedNodes.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/ThreeMfLooks.h"
#include "server/import/reader/printing/ThreeMfModel.h"
#include "server/import/reader/printing/ThreeMfRelations.h"
#include "server/import/reader/printing/ZipArchive.h"

namespace tessera {
namespace {

constexpr std::size_t kMostParts = 4096;
constexpr const char* kTakenOtherwise = "it does not say where its model is (_rels/.rels); this is taken";

/// A model part, once it is read.
struct ThreeMfPart {
    std::string name;
    ThreeMfModel model;
    std::vector<PrintedObject*> objects;  ///< as the model's, once they are made
};

class ThreeMfReader {
public:
    ThreeMfReader(ZipArchive archive, const ReadLimits& limits)
        : archive_(std::move(archive)),
          limits_(limits),
          toRead_(archive_.packedWith(".model")),
          pictures_(scene_, limits),
          nodes_(scene_, limits) {}

    Expected<PlainScene> read() {
        if (Expected<void> done = readParts(); !done) return tl::unexpected(done.error());
        makeObjects();
        placeComponents();
        const ThreeMfPart& start = parts_.front();
        proto::scene::Node& root =
            nodes_.addRoot(start.model.title.empty() ? "model" : start.model.title, start.model.unitMetres);
        if (Expected<void> done = nodes_.place(itemsOf(start), root); !done) return tl::unexpected(done.error());
        pictures_.finish();
        notes_.writeTo(scene_);
        if (!fault_.message.empty()) scene_.noteMissing(fault_.message + "; what comes before is shown");
        if (scene_.file.mesh().empty()) return nothing();
        constexpr std::uint32_t kZUp = 3;  // proto/scene.proto
        scene_.file.set_up_axis(kZUp);
        return std::move(scene_);
    }

private:
    [[nodiscard]] Expected<PlainScene> nothing() const {
        if (!fault_.message.empty()) return tl::unexpected(fault_);
        return fail(ErrorCode::kBadInput,
                    fmt::format("it has no triangles that can be shown{}{}", scene_.notes.empty() ? "" : ": ",
                                scene_.notes.empty() ? "" : scene_.notes.front()));
    }

    PrintingRemark remarks() {
        return [this](const std::string& what, const std::string& name, bool isMissing) {
            notes_.add(what, foreignName(name, ""), isMissing);
        };
    }

    /// Of a path of the package; null: there is none. Archives have percent signs as the path has them, or what they
    /// stand for.
    [[nodiscard]] const ZipEntry* entryOf(std::string_view path) const {
        for (const bool isDecoded : {false, true})
            if (const std::string name = partNameOf(path, isDecoded); !name.empty())
                if (const ZipEntry* const entry = archive_.find(name)) return entry;
        return nullptr;
    }

    [[nodiscard]] const ZipEntry* startPart() {
        if (const ZipEntry* const relations = archive_.find("_rels/.rels")) {
            const Expected<Bytes> bytes = archive_.read(*relations, std::size_t{4} << 20);
            if (const ZipEntry* const named = entryOf(bytes ? startPartOf(*bytes) : std::string())) return named;
        }
        const ZipEntry* entry = archive_.find("3D/3dmodel.model");
        if (entry == nullptr) entry = archive_.firstWith(".model");
        if (entry != nullptr) notes_.add(kTakenOtherwise, entry->name);
        return entry;
    }

    /// The start part, and those that it names, each once.
    Expected<void> readParts() {
        const ZipEntry* const start = startPart();
        if (start == nullptr)
            return fail(
                ErrorCode::kBadInput,
                "it has no model (3D/3dmodel.model): it is another zip archive, or lost it; save it anew as 3MF");
        (void)partOf(start);
        for (std::size_t next = 0; next < parts_.size(); ++next) {
            if (Expected<void> done = readPart(parts_[next]); !done) return done;
            for (std::size_t path = 1; path < parts_[next].model.paths.size(); ++path)
                (void)partOf(entryOf(parts_[next].model.paths[path]));
        }
        return {};
    }

    /// The number of a part by its name; a new one where it is in the archive and has not been named.
    std::optional<std::size_t> partOf(const ZipEntry* entry) {
        if (entry == nullptr) return std::nullopt;
        const auto [known, isNew] = partNumbers_.try_emplace(entry, parts_.size());
        if (isNew) {
            if (parts_.size() == kMostParts) {
                partNumbers_.erase(known);
                notes_.add("model parts beyond 4096 are left out", foreignName(entry->name, ""), true);
                return std::nullopt;
            }
            parts_.emplace_back().name = entry->name;
        }
        return known->second;
    }

    Expected<void> readPart(ThreeMfPart& part) {
        ThreeMfParser::Limits limits;
        limits.maxPlaces = std::min(limits.maxPlaces, limits_.maxNodes);
        // Of all parts together.
        limits.maxResources = std::min(limits.maxResources, mostPrintedResources(limits_, toRead_, true));
        limits.maxResources -= std::min(limits.maxResources, resources_);
        ThreeMfParser parser(part.model, remarks(), limits);
        bool isTaken = true;
        std::size_t passed = 0;
        const Expected<void> unpacked =
            archive_.unpack(*archive_.find(part.name), [&](ByteSpan piece, std::size_t behind) {
                passed = behind;
                sayProgress(read_ + passed, toRead_);
                return isTaken = parser.feed(piece);
            });
        read_ += passed;
        resources_ += part.model.objects.size() + part.model.properties.size() + part.model.textures.size();
        Expected<void> done = unpacked ? parser.finish() : unpacked;
        if (done) return {};
        if (unpacked) done = failWith(fmt::format("'{}'", foreignName(part.name, "")), done.error());
        if (done.error().code != ErrorCode::kBadInput) return done;
        if (fault_.message.empty()) fault_ = done.error();
        return {};
    }

    void makeObjects() {
        for (std::size_t number = 0; number < parts_.size(); ++number) {
            ThreeMfPart& part = parts_[number];
            ThreeMfLooks looks(part.model, remarks());
            for (ThreeMfObject& object : part.model.objects) part.objects.push_back(&makeObject(number, looks, object));
        }
    }

    PrintedObject& makeObject(std::size_t part, ThreeMfLooks& resolver, ThreeMfObject& object) {
        std::vector<ThreeMfLook> looks;
        PrintedMesh mesh = resolver.meshOf(object, looks);
        PrintedObject& made = nodes_.addObject(!object.name.empty()     ? object.name
                                               : object.id != kNoNumber ? fmt::format("object {}", object.id)
                                                                        : "object");
        // What is no part of the print itself, but helps to make it: modifiers, blockers.
        made.isHidden = object.type == "other";
        if (made.isHidden) notes_.add("objects of type other are not printed, and are hidden by a Switch", made.name);
        if (const std::string leftOut = leaveOutUnsound(mesh, made.name); !leftOut.empty()) scene_.noteMissing(leftOut);
        std::vector<PrintedLook> needs;
        for (const ThreeMfLook& look : looks)
            needs.push_back({look.kind == ThreeMfLook::Kind::kColors || look.kind == ThreeMfLook::Kind::kPicture,
                             look.kind == ThreeMfLook::Kind::kPicture});
        for (PrintedPart& piece : partedByLooks(std::move(mesh), needs, !limits_.verbatim)) {
            const std::string& material = materialOf(part, looks[piece.look]);
            nodes_.addMesh(made, titleOf(part, looks[piece.look]), std::move(piece.mesh), material);
        }
        return made;
    }

    [[nodiscard]] std::string titleOf(std::size_t part, const ThreeMfLook& look) const {
        if (look.kind != ThreeMfLook::Kind::kBase) return "part";
        return foreignName(parts_[part].model.properties.at(look.of).names[look.index], "part");
    }

    /// The name of the material that a look is; empty: nothing is to be said.
    const std::string& materialOf(std::size_t part, const ThreeMfLook& look) {
        using Kind = ThreeMfLook::Kind;
        static const std::string kNone;
        if (look.kind == Kind::kPlain) return look.hasTwoSides ? scene_.plainMaterial() : kNone;
        // Colours mean the same in each part.
        const bool isOfPart = look.kind == Kind::kBase || look.kind == Kind::kPicture;
        std::string& name = materials_[{isOfPart ? part : 0, look}];
        if (!name.empty()) return name;
        PrintedMaterial material{.isTranslucent = look.isTranslucent, .hasTwoSides = look.hasTwoSides};
        switch (look.kind) {
            case Kind::kBase: {
                const ThreeMfProperties& group = parts_[part].model.properties.at(look.of);
                material.color = group.colors[look.index];
                material.name = group.names[look.index];
                break;
            }
            case Kind::kColor:
                material.color = look.index;
                material.name = fmt::format("#{:08X}", look.index);
                break;
            case Kind::kPicture:
                material.name = fmt::format("picture {}", look.of);
                material.image = imageOf(part, look.of);
                break;
            default:
                material.name = look.isTranslucent ? "colours, translucent" : "colours";
                break;
        }
        return name = nodes_.addMaterial(material);
    }

    /// Of a texture the name of its Image; empty: it cannot be had, as a note says.
    std::string imageOf(std::size_t part, std::uint32_t texture) {
        using Wrap = ThreeMfTexture::Wrap;
        const auto found = parts_[part].model.textures.find(texture);
        if (found == parts_[part].model.textures.end()) {
            notes_.add("pictures that the model does not have: what shows them is white", std::to_string(texture));
            return {};
        }
        const ThreeMfTexture& said = found->second;
        const std::string shown = foreignName(said.path, "");
        const std::string name = fmt::format("picture {} of part {}", texture, part);
        const Expected<proto::scene::Image*> image =
            pictures_.addImage(name, fmt::format("'{}'", shown), [&]() -> Expected<DecodedImage> {
                const ZipEntry* const entry = entryOf(said.path);
                if (entry == nullptr) return fail(ErrorCode::kNotFound, "it is not in the package");
                const Expected<Bytes> bytes = archive_.read(*entry, limits_.maxFileBytes);
                if (!bytes) return tl::unexpected(bytes.error());
                return pictures_.decode(*bytes);
            });
        if (!image) {
            scene_.note(fmt::format("the picture '{}' cannot be had: {}; what shows it is white", shown,
                                    image.error().message));
            return {};
        }
        const auto wrapOf = [](Wrap wrap) {
            return wrap == Wrap::kMirror  ? proto::scene::Image::MIRROR
                   : wrap == Wrap::kClamp ? proto::scene::Image::CLAMP
                                          : proto::scene::Image::REPEAT;
        };
        (*image)->set_wrap_u(wrapOf(said.wrapU));
        (*image)->set_wrap_v(wrapOf(said.wrapV));
        if (said.isNearest) (*image)->set_magnification(proto::scene::Image::NEAREST);
        return name;
    }

    /// What a place stands for; nothing: it does not stand, as a note says.
    std::optional<PrintedPlace> placeOf(const ThreeMfPart& in, const ThreeMfPlace& place) {
        const std::string whose = place.object == kNoNumber ? std::string() : std::to_string(place.object);
        std::optional<std::size_t> part = static_cast<std::size_t>(&in - parts_.data());
        if (place.path != ThreeMfPlace::kHere) {
            const std::string& path = in.model.paths[place.path];
            part = partOf(entryOf(path));
            if (!part) {
                notes_.add("model parts that are not in the package: what they hold is left out", foreignName(path, ""),
                           true);
                return std::nullopt;
            }
        }
        const ThreeMfPart& of = parts_[*part];
        const auto object = of.model.objectOf.find(place.object);
        if (object == of.model.objectOf.end()) {
            notes_.add("objects that do not exist are placed, and left out", whose, true);
            return std::nullopt;
        }
        Affine3d map = Affine3d::Identity();
        if (place.transform != ThreeMfPlace::kUnsound) {
            const ThreeMfTransform& rows = in.model.transforms[place.transform];
            for (Eigen::Index row = 0; row < 3; ++row) {
                for (Eigen::Index column = 0; column < 3; ++column)
                    map.linear()(row, column) = rows[static_cast<std::size_t>(3 * column + row)];
                map.translation()(row) = rows[static_cast<std::size_t>(9 + row)];
            }
        }
        if (place.transform == ThreeMfPlace::kUnsound || !isRegular(map)) {
            notes_.add("objects whose transform is no twelve numbers, or flattens them, are left out", whose, true);
            return std::nullopt;
        }
        PrintedObject* const placed = of.objects[object->second];
        const std::string& partNumber = in.model.partNumbers[place.partNumber];
        const bool isNamed = partNumber.empty() || !of.model.objects[object->second].name.empty();
        return PrintedPlace{isNamed ? placed->name : partNumber, placed, map};
    }

    void placeComponents() {
        for (const ThreeMfPart& part : parts_)
            for (std::size_t i = 0; i < part.model.objects.size(); ++i)
                for (const ThreeMfPlace& component : part.model.objects[i].components)
                    if (std::optional<PrintedPlace> place = placeOf(part, component))
                        part.objects[i]->places.push_back(std::move(*place));
    }

    /// Of a model without a build, or one that is cut off before it, all objects that are in no other.
    std::vector<PrintedPlace> itemsOf(const ThreeMfPart& start) {
        std::vector<PrintedPlace> items;
        for (const ThreeMfPlace& item : start.model.items)
            if (std::optional<PrintedPlace> place = placeOf(start, item)) items.push_back(std::move(*place));
        if (!start.model.items.empty()) return items;
        if (fault_.message.empty()) notes_.add("its build places nothing: all its objects are shown", "");
        for (const ThreeMfPart& part : parts_)
            for (std::size_t i = 0; i < part.objects.size(); ++i)
                if (const auto known = part.model.objectOf.find(part.model.objects[i].id); known->second == i)
                    items.push_back({part.objects[i]->name, part.objects[i], Affine3d::Identity()});
        PrintedNodes::dropPlacedElsewhere(items);
        return items;
    }

    ZipArchive archive_;
    const ReadLimits& limits_;
    std::size_t toRead_, read_ = 0, resources_ = 0;
    PlainScene scene_;
    Pictures pictures_;
    PrintedNodes nodes_;
    CountedNotes notes_;
    std::vector<ThreeMfPart> parts_;
    std::map<const ZipEntry*, std::size_t> partNumbers_;
    std::map<std::pair<std::size_t, ThreeMfLook>, std::string> materials_;
    Error fault_;  ///< where a part is cut off or damaged; no message: nowhere
};

}  // namespace

Expected<PlainScene> readThreeMf(const std::string& path, const ReadLimits& limits) {
    Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    Expected<ZipArchive> archive = ZipArchive::open(file->bytes());
    if (!archive) return failWith("it is no 3MF that can be read", archive.error());
    return ThreeMfReader(std::move(*archive), limits).read();
}

}  // namespace tessera
