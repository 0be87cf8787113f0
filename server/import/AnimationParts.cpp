#include "server/import/AnimationParts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "common/animation/KeyTrack.h"
#include "common/base/Nearest.h"
#include "common/drawable/SkinArrays.h"
#include "common/scene/FieldTable.h"
#include "server/import/MessageArrays.h"

namespace tessera {
namespace {

constexpr int kMostKeyNumbers = 50'000'000;

tl::unexpected<Error> failAtPart(const std::string& where, std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("{}: {}", where, what));
}

Expected<Blob> keyNumbers(const LoadedFile& file, const google::protobuf::RepeatedField<double>& written,
                          std::uint32_t blob) {
    if (blob != 0) return file.blob(blob);
    if (written.size() > kMostKeyNumbers)
        return fail(ErrorCode::kLimit, fmt::format("a channel has more than {} numbers", kMostKeyNumbers));
    return blobOfNumbers(written);
}

}  // namespace

AnimationParts::Outer AnimationParts::beginFile() {
    return {std::exchange(keys_, {}), pending_.size()};
}

Expected<void> AnimationParts::endFile(LoadedFile& file, Outer outer) {
    for (std::size_t i = outer.pending; i < pending_.size(); ++i)
        if (Expected<void> done = resolve(file, pending_[i]); !done) return done;
    pending_.resize(outer.pending);
    keys_ = std::move(outer.keys);
    return {};
}

void AnimationParts::take(const LoadedFile& file, const proto::scene::Node& node, ObjectId core, PlacedNode* from,
                          PlacedNode* top) {
    if (!node.has_animation() && !node.has_skin()) return;
    pending_.push_back({.core = core,
                        .animation = node.has_animation() ? &node.animation() : nullptr,
                        .skin = node.has_skin() ? &node.skin() : nullptr,
                        .from = from,
                        .top = top,
                        .where = placeText(file.label, node.has_skin() ? node.skin().at() : node.animation().at())});
}

Expected<void> AnimationParts::resolve(LoadedFile& file, const Pending& parts) {
    if (parts.skin) return resolveJoints(file, parts);
    RefList channels;
    for (const proto::scene::Channel& channel : parts.animation->channel()) {
        const Expected<ObjectId> frames = keyFrames(file, channel, parts);
        if (!frames) return tl::unexpected(frames.error());
        channels.push_back(*frames);
    }
    setField<&Animation::channels>(draft_.list(), parts.core, channels);
    return {};
}

PlacedNode* AnimationParts::atKey(std::uint32_t key) const {
    const auto found = keys_.find(key);
    return found == keys_.end() ? nullptr : found->second;
}

Expected<void> AnimationParts::resolveJoints(LoadedFile& file, const Pending& parts) {
    std::vector<const PlacedNode*> joints;
    const auto add = [&](const PlacedNode* joint, const std::string& name) -> Expected<void> {
        if (!joint)
            return failAtPart(parts.where,
                              fmt::format("there is no node '{}' for this skin's joint {}", name, joints.size()));
        if (!joint->id || std::ranges::find(joints, joint) != joints.end())
            return failAtPart(parts.where, fmt::format("this skin has the joint '{}' twice", name));
        joints.push_back(joint);
        return {};
    };
    for (const std::string& name : parts.skin->joint())
        if (Expected<void> added =
                add(name.empty() ? nullptr : PlacedNodes::find(parts.from, parts.top, name), readName(name, ""));
            !added)
            return added;
    for (const std::uint32_t key : parts.skin->joint_key())
        if (Expected<void> added = add(atKey(key), fmt::format("key {}", key)); !added) return added;
    if (joints.empty()) return {};
    RefList ids;
    for (const PlacedNode* joint : joints) ids.push_back(joint->id);
    setField<&Skin::joints>(draft_.list(), parts.core, ids);
    if (parts.skin->pose_blob() != 0) return {};

    // Where the joints stand now, as the server will say in the first frame: whoever looks before sees the same.
    bool told = true;
    const auto top_T = [&](const PlacedNode* node) {
        Affine3d place = Affine3d::Identity();
        for (; node != nullptr && node != parts.top; node = node->parent) {
            place = node->parent_T_node * place;
            told = told && !node->movesOtherwise;
        }
        return place;
    };
    Expected<Blob> binds = file.blob(parts.skin->inverse_binds_blob());
    if (!binds) return failWith(parts.where, binds.error());
    const std::span<const float> rows =
        parts.skin->inverse_binds_blob() != 0
            ? binds->as<float>()
            : std::span<const float>(parts.skin->inverse_bind().data(),
                                     static_cast<std::size_t>(parts.skin->inverse_bind_size()));
    const Affine3d bearer_T_top = top_T(parts.from).inverse(Eigen::Affine);
    std::vector<float> pose;
    for (std::size_t j = 0; j < joints.size(); ++j) {
        Affine3d bind = Affine3d::Identity();
        for (std::size_t i = 0; i < 12 && 12 * (j + 1) <= rows.size(); ++i)
            bind(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
                static_cast<double>(rows[12 * j + i]);
        const Affine3d matrix = bearer_T_top * top_T(joints[j]) * bind;
        for (Eigen::Index i = 0; i < 12; ++i) {
            const double number = matrix(i / 4, i % 4);
            told = told && std::abs(number) <= kGreatestSkinNumber;
            pose.push_back(told ? static_cast<float>(number) : 0.0f);
        }
    }
    if (told) setField<&Skin::pose>(draft_.list(), parts.core, Blob::of(std::span<const float>(pose)));
    return {};
}

Expected<ObjectId> AnimationParts::channelTarget(LoadedFile& file, const proto::scene::Channel& channel,
                                                 const Pending& parts) {
    if (!channel.material().empty()) {
        const Expected<ObjectId> material = materials_.material(file, channel.material());
        if (!material) return failWith(parts.where, material.error());
        return material;
    }
    const PlacedNode* found = nullptr;
    const std::string shown =
        channel.target_key() != 0 ? fmt::format("key {}", channel.target_key()) : readName(channel.target(), "");
    if (channel.target_key() != 0) {
        found = atKey(channel.target_key());
    } else if (!channel.target().empty()) {
        found = PlacedNodes::find(parts.from, parts.top, channel.target());
    } else {
        return failAtPart(parts.where, "a channel of this animation names neither target nor material");
    }
    if (!found)
        return failAtPart(parts.where, fmt::format("there is no node '{}' for a channel of this animation", shown));
    std::string kinds;
    std::vector<std::string> fields;
    for (const ObjectId candidate : {found->transform, found->content, found->id}) {
        if (!candidate) continue;
        const TypeInfo* type = draft_.typeOfCreated(candidate);
        if (findField(*type, channel.field())) return candidate;
        kinds += fmt::format("{}{}", kinds.empty() ? "" : ", ", type->name);
        for (const FieldEntry& field : type->fields) fields.emplace_back(field.name);
    }
    const std::string nearest = nearestName(channel.field(), fields);
    return failAtPart(parts.where, fmt::format("'{}' ({}) has no field '{}' that a channel could drive{}", shown, kinds,
                                               readName(channel.field(), ""),
                                               nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

Expected<ObjectId> AnimationParts::keyFrames(LoadedFile& file, const proto::scene::Channel& channel,
                                             const Pending& parts) {
    if (channel.has_interpolation() && !proto::scene::Channel::Interpolation_IsValid(channel.interpolation()))
        return failAtPart(parts.where, "a channel's interpolation is none of its words");
    const Expected<ObjectId> target = channelTarget(file, channel, parts);
    if (!target) return target;
    KeyFrames frames;
    frames.target = *target;
    frames.field = channel.field();
    if (channel.has_interpolation()) frames.interpolation = channel.interpolation();
    for (const auto& [blob, written, number] : {std::tuple(&frames.times, &channel.time(), channel.times_blob()),
                                                std::tuple(&frames.values, &channel.value(), channel.values_blob())}) {
        Expected<Blob> numbers = keyNumbers(file, *written, number);
        if (!numbers) return failWith(parts.where, numbers.error());
        *blob = std::move(*numbers);
    }
    const TypeInfo* type = draft_.typeOfCreated(*target);
    if (const Expected<KeyTrack> sound = KeyTrack::of(frames, type); !sound)
        return failWith(fmt::format("{}: the channel of '{}'", parts.where, readName(channel.field(), "")),
                        sound.error());
    static constexpr std::array<std::string_view, 4> kMoving = {"translation", "rotation", "scale", "center"};
    if (type->pose && std::ranges::find(kMoving, channel.field()) != kMoving.end())
        names_.isDriven(*target, "an animation");
    return draft_.create(frames);
}

}  // namespace tessera
