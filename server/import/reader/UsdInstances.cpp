// PointInstancer: prototypes at many places.
//
// A place is a node with the prototype's Definition below: prototypes may be whole trees, and anybody may move, pick
// and hit one. That is about a kilobyte each. Of very many places, or where each has a colour of its own, those of a
// few small meshes are Glyphs (GlyphPlaces.h).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "common/math/Compose.h"
#include "common/math/Srgb.h"
#include "server/import/reader/GlyphPlaces.h"
#include "server/import/reader/UsdReader.h"

namespace tessera {
namespace {

/// Where the instances are; all arrays as long as `prototypes`.
struct InstancePlaces {
    std::vector<std::int32_t> prototypes;
    std::vector<double> positions, orientations, scales;  ///< the last two may be empty
    std::vector<bool> shown;
    std::vector<std::uint32_t> colors;  ///< 0xRRGGBBAA, sRGB; empty: none has one of its own

    [[nodiscard]] std::size_t count() const { return prototypes.size(); }
    /// Nothing: it stands nowhere.
    [[nodiscard]] bool stands(std::size_t i) const {
        return std::isfinite(positions[3 * i]) && std::isfinite(positions[3 * i + 1]) &&
               std::isfinite(positions[3 * i + 2]) &&
               std::max({std::abs(positions[3 * i]), std::abs(positions[3 * i + 1]), std::abs(positions[3 * i + 2])}) <
                   1e15;
    }
    [[nodiscard]] Vec3d position(std::size_t i) const {
        return {positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]};
    }
    [[nodiscard]] Quatd orientation(std::size_t i) const { return turn(i).normalized(); }
    /// As the file says it.
    [[nodiscard]] Quatd turn(std::size_t i) const {
        if (orientations.empty()) return Quatd::Identity();
        return isTurned(i) ? saidTurn(i) : Quatd::Identity();
    }
    [[nodiscard]] Vec3d scale(std::size_t i) const {
        return !scales.empty() && isScaled(i) ? saidScale(i) : Vec3d(Vec3d::Ones());
    }
    /// False: what it says means nothing.
    [[nodiscard]] bool isTurned(std::size_t i) const {
        return orientations.empty() || (saidTurn(i).coeffs().allFinite() && saidTurn(i).norm() > 1e-6);
    }
    [[nodiscard]] bool isScaled(std::size_t i) const {
        return scales.empty() || (saidScale(i).allFinite() && saidScale(i).cwiseAbs().maxCoeff() < 1e12);
    }

private:
    [[nodiscard]] Quatd saidTurn(std::size_t i) const {
        return {orientations[4 * i + 3], orientations[4 * i], orientations[4 * i + 1], orientations[4 * i + 2]};
    }
    [[nodiscard]] Vec3d saidScale(std::size_t i) const { return {scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]}; }
};

std::vector<double> instanceNumbers(const UsdComposedPrim& prim, std::string_view name, UsdRemarks& remarks) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    if (!attribute || !attribute->value) return {};
    if (attribute->samples.size() > 1) remarks.add("instances that move stand where they are first", prim.path());
    return attribute->value->numbers<double>();
}

/// What stands as the prototype itself does, since it says nothing that could be done.
void remarkUnsound(const InstancePlaces& places, const UsdComposedPrim& prim, UsdRemarks& remarks) {
    bool areScaled = true, areTurned = true;
    for (std::size_t i = 0; i < places.count(); ++i) {
        areScaled = areScaled && places.isScaled(i);
        areTurned = areTurned && places.isTurned(i);
    }
    if (!areScaled) remarks.add("scales of instances that are not finite, or beyond 1e12, count as 1", prim.path());
    if (!areTurned) remarks.add("orientations of instances that are zero, or not finite, turn nothing", prim.path());
}

InstancePlaces instancePlacesOf(const UsdComposedPrim& prim, UsdRemarks& remarks) {
    InstancePlaces places;
    for (const double index : instanceNumbers(prim, "protoIndices", remarks))
        places.prototypes.push_back(index >= 0 && index < 1e9 ? static_cast<std::int32_t>(index) : -1);
    places.positions = instanceNumbers(prim, "positions", remarks);
    for (const char* name : {"orientationsf", "orientations"})
        if (places.orientations.empty()) places.orientations = instanceNumbers(prim, name, remarks);
    places.scales = instanceNumbers(prim, "scales", remarks);
    const std::size_t count = std::min(places.prototypes.size(), places.positions.size() / 3);
    if (places.prototypes.size() != count || places.positions.size() != 3 * count)
        remarks.add("instancers whose arrays are of different lengths show as many as all have", prim.path());
    places.prototypes.resize(count);
    if (places.orientations.size() < 4 * count) places.orientations.clear();
    if (places.scales.size() < 3 * count) places.scales.clear();
    remarkUnsound(places, prim, remarks);
    // Instances that are not to be seen are named by their ids, which are their numbers where there are none.
    std::set<double> hidden;
    for (const double id : instanceNumbers(prim, "invisibleIds", remarks)) hidden.insert(id);
    if (const UsdValue* inactive = prim.metadata("inactiveIds"))
        for (const double id : inactive->numbers<double>()) hidden.insert(id);
    const std::vector<double> ids = hidden.empty() ? std::vector<double>() : instanceNumbers(prim, "ids", remarks);
    places.shown.assign(count, true);
    for (std::size_t i = 0; i < count && !hidden.empty(); ++i)
        places.shown[i] = !hidden.contains(ids.size() == count ? ids[i] : static_cast<double>(i));
    // "vertex", "varying" or "uniform": one for each instance. "constant" ones are inherited.
    const UsdElements elements{.faces = count, .vertices = count, .corners = count};
    const auto colors = UsdPrimvar::of(prim, nullptr, "primvars:displayColor", 3, elements, remarks);
    if (prim.attribute("primvars:displayOpacity")) remarks.add("opacities of instances are left out", prim.path());
    for (std::size_t i = 0; colors && colors->per() != UsdPrimvar::Per::kAll && i < count; ++i) {
        std::uint32_t color = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const float light = std::clamp(colors->at(i, i, i)[k], 0.0F, 1.0F);  // of NaN 0
            color = color << 8 | static_cast<std::uint32_t>(std::lround(255 * srgbOfLinear(light > 0 ? light : 0.0F)));
        }
        places.colors.push_back(color << 8 | 0xff);
    }
    return places;
}

}  // namespace

Expected<UsdReader::Prototype> UsdReader::prototype(const std::string& path, const Above& inside) {
    const std::string key =
        fmt::format("{}\n{} {}{}", path, inside.material, inside.materialHolds, usdPrintOf(inside.primvars.get()));
    if (const auto known = prototypes_.find(key); known != prototypes_.end()) return known->second;
    Prototype made;
    const Expected<UsdStage::Prim> prim = stage_.at(path);
    if (!prim) return tl::unexpected(prim.error());
    if (!*prim || !openPrototypes_.insert(path).second) {
        remarks_.add(*prim ? "prototypes that hold themselves are left out" : "prototypes that are not there", path);
        return made;
    }
    proto::scene::Definition definition;
    definition.set_name(fmt::format("prototype {}", prototypeNames_++));
    Above above = inside;
    above.make = [&] { return definition.add_node(); };
    above.world_T_parent = above.parent_T_above = Affine3d::Identity();
    const Box bounds = std::exchange(bounds_, Box());
    const bool within = std::exchange(inPrototype_, true);
    const std::size_t before = nodes_;
    const Expected<void> walked = walk(**prim, above);
    made.nodes = nodes_ - before;
    inPrototype_ = within;
    made.bounds = std::exchange(bounds_, bounds);
    openPrototypes_.erase(path);
    if (!walked) return tl::unexpected(walked.error());
    if (definition.node_size() > 0) {
        made.definition = definition.name();
        made.number = scene_.file.definition_size();
        *scene_.file.add_definition() = std::move(definition);
    }
    prototypes_.emplace(key, made);
    return made;
}

Expected<std::vector<GlyphPart>> UsdReader::glyphsOf(const proto::scene::Definition& definition) const {
    constexpr std::size_t kMostParts = 16;
    static constexpr int kPlainFields[] = {Node::kNameFieldNumber, Node::kTransformFieldNumber,
                                           Node::kGeometryFieldNumber, Node::kNodeFieldNumber};
    std::vector<GlyphPart> parts;
    std::string why;
    const auto refuse = [&](std::string said) {
        why = std::move(said);
        return false;
    };
    const auto add = [&](const auto& self, const Node& node, const Affine3d& above) -> bool {
        std::vector<const google::protobuf::FieldDescriptor*> said;
        node.GetReflection()->ListFields(node, &said);
        const auto isPlain = [](const google::protobuf::FieldDescriptor* field) {
            return std::ranges::find(kPlainFields, field->number()) != std::end(kPlainFields);
        };
        if (!std::ranges::all_of(said, isPlain)) return refuse("their prototype is more than shapes at places");
        const proto::scene::Transform& t = node.transform();
        const proto::scene::Quaternion& q = t.rotation().quaternion();
        const Affine3d place =
            above *
            composeTransform(Vec3d(t.translation().x(), t.translation().y(), t.translation().z()),
                             t.has_rotation() ? Quatd(q.w(), q.x(), q.y(), q.z()) : Quatd::Identity(),
                             t.has_scale() ? Vec3d(t.scale().x(), t.scale().y(), t.scale().z()) : Vec3d(Vec3d::Ones()));
        if (node.has_geometry()) {
            Expected<GlyphPart> part = glyphOf(scene_, node.geometry().mesh(), node.geometry().material(), place);
            if (!part) return refuse("a mesh of their prototype " + part.error().message);
            if (parts.size() == kMostParts)
                return refuse(fmt::format("their prototype has over {} meshes", kMostParts));
            parts.push_back(std::move(*part));
        }
        return std::ranges::all_of(node.node(), [&](const Node& below) { return self(self, below, place); });
    };
    const bool isAll =
        std::ranges::all_of(definition.node(), [&](const Node& node) { return add(add, node, Affine3d::Identity()); });
    if (!isAll) return fail(ErrorCode::kUnsupported, why);
    return parts;
}

Expected<void> UsdReader::addInstances(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNodes) {
    const std::vector<std::string> targets = prim.targets("prototypes");
    InstancePlaces places = instancePlacesOf(prim, remarks_);
    std::vector<Prototype> prototypes;
    for (const std::string& target : targets) {
        Expected<Prototype> made = prototype(target, inside);
        if (!made) return tl::unexpected(made.error());
        prototypes.push_back(std::move(*made));
    }
    std::size_t lost = 0;
    for (std::size_t i = 0; i < places.count(); ++i)
        if (const auto which = static_cast<std::size_t>(places.prototypes[i]);
            places.shown[i] && places.prototypes[i] >= 0 && which < prototypes.size() && places.stands(i))
            bounds_.extend(prototypes[which].bounds.transformed(
                inside.world_T_parent * composeTransform(places.position(i), places.orientation(i), places.scale(i))));
    const bool colored = !places.colors.empty();
    const auto placeOf = [&](std::size_t i) {
        return CopyPlace{places.position(i), places.turn(i), places.scale(i), colored ? places.colors[i] : 0xffffffff};
    };
    // Files of our own have glyphs so, in their node itself.
    const bool ours = scene_.file.by_tessera();
    const auto make = [&](std::size_t first, std::size_t part) {
        if (ours && !ownNodes && node.content_case() == Node::CONTENT_NOT_SET) return &node;
        Node* const made = inside.make();
        made->set_name(instancesName(first, part));
        return made;
    };
    std::vector<std::vector<std::size_t>> standing(prototypes.size());
    for (std::size_t i = 0; i < places.count(); ++i)
        if (const auto prototype = static_cast<std::size_t>(places.prototypes[i]);
            places.shown[i] && prototype < standing.size() && places.stands(i))
            standing[prototype].push_back(i);
    for (std::size_t prototype = 0; prototype < prototypes.size(); ++prototype) {
        const std::vector<std::size_t>& which = standing[prototype];
        if (which.empty() || prototypes[prototype].definition.empty()) continue;
        if (!ours && !colored && !areVeryMany(std::max(which.size(), places.count()), 0) &&
            !areVeryMany(which.size(), prototypes[prototype].nodes))
            continue;
        const auto areNodes = [&](std::size_t count, std::string_view why) {
            if (colored) remarks_.add(fmt::format("colours of instances are left out: {}", why), prim.path());
            if (areVeryMany(count, prototypes[prototype].nodes))
                scene_.note(noteOfPlacedNodes(prim.path(), count, why));
        };
        auto parts = glyphsOf(scene_.file.definition(prototypes[prototype].number));
        if (!parts) {
            areNodes(which.size(), parts.error().message);
            continue;
        }
        if (parts->empty()) continue;
        if (Expected<void> counted = countNodes(which.size() * parts->size() / ReadLimits::kGlyphsPerNode); !counted)
            return counted;
        noteUnsorted(scene_, prim.path(), *parts);
        // What has a material, or a colour of its own, is of that.
        for (GlyphPart& part : *parts)
            if (colored && part.shape.material().empty())
                part.shape.set_material(materials_.colored(false, false).material);
        const auto isColored = [&](const GlyphPart& part) {
            return ours || (part.color == 0xffffffff && part.shape.material().starts_with(UsdMaterials::kColored));
        };
        const auto whitePlaceOf = [&](std::size_t i) {
            CopyPlace place = placeOf(i);
            place.color = 0xffffffff;
            return place;
        };
        std::vector<GlyphPart> own, others;
        for (GlyphPart& part : *parts) (colored && isColored(part) ? own : others).push_back(std::move(part));
        for (const std::size_t i : which) places.shown[i] = false;
        std::vector<std::size_t> left;
        if (!own.empty()) left = addGlyphs(which, placeOf, own, make);
        if (!others.empty()) left = addGlyphs(which, whitePlaceOf, others, make);
        for (const std::size_t i : left) places.shown[i] = true;
        if (!left.empty()) areNodes(left.size(), kOddScales);
    }
    for (std::size_t i = 0; i < places.count(); ++i) {
        if (!places.shown[i]) continue;
        const auto which = static_cast<std::size_t>(places.prototypes[i]);
        if (places.prototypes[i] < 0 || which >= prototypes.size() || !places.stands(i)) {
            ++lost;
            continue;
        }
        const Prototype& prototype = prototypes[which];
        if (prototype.definition.empty()) continue;
        if (Expected<void> counted = countNodes(1 + prototype.nodes); !counted) return counted;
        Node& placed = *inside.make();
        placed.set_name(fmt::format("instance {}", i));
        setTransform(*placed.mutable_transform(), places.position(i), places.orientation(i), places.scale(i));
        placed.set_instance(prototype.definition);
    }
    if (lost > 0)
        scene_.noteMissing(fmt::format("{}: {} of {} instances are left out, as they have no prototype or no place",
                                       prim.path(), lost, places.count()));
    return {};
}

}  // namespace tessera
