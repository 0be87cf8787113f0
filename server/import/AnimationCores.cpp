// Channels find what they drive, and skins their joints.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/animation/KeyTrack.h"
#include "common/base/Nearest.h"
#include "common/drawable/SkinArrays.h"
#include "common/scene/FieldTable.h"
#include "server/import/SceneAssembly.h"

namespace tessera {
namespace {

constexpr int kMostKeyNumbers = 50'000'000;

tl::unexpected<Error> failAtPart(const std::string& where, std::string_view what) { return fail(ErrorCode::kBadInput, fmt::format("{}: {}", where, what)); }

Expected<Blob> keyNumbers(const LoadedFile& file, const google::protobuf::RepeatedField<double>& written, std::uint32_t blob) {
    if (blob != 0) return file.blob(blob);
    if (written.size() > kMostKeyNumbers) return fail(ErrorCode::kLimit, fmt::format("a channel has more than {} numbers", kMostKeyNumbers));
    return written.empty() ? Blob() : Blob::of(std::span<const double>(written.data(), static_cast<std::size_t>(written.size())));
}

}  // namespace

Expected<void> SceneAssembly::resolveParts(LoadedFile& file, const PendingParts& parts) {
    if (parts.skin) return resolveJoints(file, parts);
    RefList channels;
    for (const proto::scene::Channel& channel : parts.animation->channel()) {
        const Expected<ObjectId> frames = keyFrames(file, channel, parts);
        if (!frames) return tl::unexpected(frames.error());
        channels.push_back(*frames);
    }
    builder_.set(parts.core, typeOf<Animation>(), fieldId<&Animation::channels>, channels);
    return {};
}

Expected<void> SceneAssembly::resolveJoints(LoadedFile& file, const PendingParts& parts) {
    std::vector<const Placed*> joints;
    const auto add = [&](const Placed* joint, const std::string& name) -> Expected<void> {
        if (!joint) return failAtPart(parts.where, fmt::format("there is no node '{}' for this skin's joint {}", name, joints.size()));
        if (!joint->id || std::ranges::find(joints, joint) != joints.end()) return failAtPart(parts.where, fmt::format("this skin has the joint '{}' twice", name));
        joints.push_back(joint);
        return {};
    };
    for (const std::string& name : parts.skin->joint())
        if (Expected<void> added = add(name.empty() ? nullptr : find(parts.from, parts.top, name), readName(name, "")); !added) return added;
    for (const std::uint32_t key : parts.skin->joint_key()) {
        const auto found = keys_.find(key);
        if (Expected<void> added = add(found == keys_.end() ? nullptr : found->second, fmt::format("key {}", key)); !added) return added;
    }
    if (joints.empty()) return {};
    RefList ids;
    for (const Placed* joint : joints) ids.push_back(joint->id);
    builder_.set(parts.core, typeOf<Skin>(), fieldId<&Skin::joints>, ids);
    if (parts.skin->pose_blob() != 0) return {};

    // Where the joints stand now, as the server will say in the first frame: whoever looks before sees the same.
    bool told = true;
    const auto top_T = [&](const Placed* node) {
        Affine3d place = Affine3d::Identity();
        for (; node != nullptr && node != parts.top; node = node->parent) {
            place = node->parent_T_node * place;
            told = told && !node->movesOtherwise;
        }
        return place;
    };
    Expected<Blob> binds = file.blob(parts.skin->inverse_binds_blob());
    if (!binds) return failWith(parts.where, binds.error());
    const std::span<const float> rows = parts.skin->inverse_binds_blob() != 0
                                            ? binds->as<float>()
                                            : std::span<const float>(parts.skin->inverse_bind().data(), static_cast<std::size_t>(parts.skin->inverse_bind_size()));
    const Affine3d bearer_T_top = top_T(parts.from).inverse(Eigen::Affine);
    std::vector<float> pose;
    for (std::size_t j = 0; j < joints.size(); ++j) {
        Affine3d bind = Affine3d::Identity();
        for (std::size_t i = 0; i < 12 && 12 * (j + 1) <= rows.size(); ++i) bind(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = static_cast<double>(rows[12 * j + i]);
        const Affine3d matrix = bearer_T_top * top_T(joints[j]) * bind;
        for (Eigen::Index i = 0; i < 12; ++i) {
            const double number = matrix(i / 4, i % 4);
            told = told && std::abs(number) <= kGreatestSkinNumber;
            pose.push_back(told ? static_cast<float>(number) : 0.0f);
        }
    }
    if (told) builder_.set(parts.core, typeOf<Skin>(), fieldId<&Skin::pose>, Blob::of(std::span<const float>(pose)));
    return {};
}

const TypeInfo* SceneAssembly::typeOfCreated(ObjectId id) const {
    const std::uint64_t place = id.value - kFirstPlaceholder;
    const TypeInfo* type = place < types_.size() ? types_[place] : nullptr;
    return type ? type : findType(typeOf<Node>());  // of what was saved only nodes are found
}

Expected<ObjectId> SceneAssembly::channelTarget(LoadedFile& file, const proto::scene::Channel& channel, const PendingParts& parts) {
    if (!channel.material().empty()) {
        const Expected<ObjectId> material = materialCore(file, channel.material());
        if (!material) return failWith(parts.where, material.error());
        return material;
    }
    const Placed* found = nullptr;
    const std::string shown = channel.target_key() != 0 ? fmt::format("key {}", channel.target_key()) : readName(channel.target(), "");
    if (channel.target_key() != 0) {
        const auto known = keys_.find(channel.target_key());
        found = known == keys_.end() ? nullptr : known->second;
    } else if (!channel.target().empty()) {
        found = find(parts.from, parts.top, channel.target());
    } else {
        return failAtPart(parts.where, "a channel of this animation names neither target nor material");
    }
    if (!found) return failAtPart(parts.where, fmt::format("there is no node '{}' for a channel of this animation", shown));
    std::string kinds;
    std::vector<std::string> fields;
    for (const ObjectId candidate : {found->transform, found->content, found->id}) {
        if (!candidate) continue;
        const TypeInfo* type = typeOfCreated(candidate);
        if (findField(*type, channel.field())) return candidate;
        kinds += fmt::format("{}{}", kinds.empty() ? "" : ", ", type->name);
        for (const FieldEntry& field : type->fields) fields.emplace_back(field.name);
    }
    const std::string nearest = nearestName(channel.field(), fields);
    return failAtPart(parts.where, fmt::format("'{}' ({}) has no field '{}' that a channel could drive{}", shown, kinds, readName(channel.field(), ""),
                                               nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

Expected<ObjectId> SceneAssembly::keyFrames(LoadedFile& file, const proto::scene::Channel& channel, const PendingParts& parts) {
    if (channel.has_interpolation() && !proto::scene::Channel::Interpolation_IsValid(channel.interpolation()))
        return failAtPart(parts.where, "a channel's interpolation is none of its words");
    const Expected<ObjectId> target = channelTarget(file, channel, parts);
    if (!target) return target;
    KeyFrames frames;
    frames.target = *target;
    frames.field = channel.field();
    if (channel.has_interpolation()) frames.interpolation = channel.interpolation();
    for (const auto& [blob, written, number] : {std::tuple(&frames.times, &channel.time(), channel.times_blob()), std::tuple(&frames.values, &channel.value(), channel.values_blob())}) {
        Expected<Blob> numbers = keyNumbers(file, *written, number);
        if (!numbers) return failWith(parts.where, numbers.error());
        *blob = std::move(*numbers);
    }
    const TypeInfo* type = typeOfCreated(*target);
    if (const Expected<KeyTrack> sound = KeyTrack::of(frames, type); !sound)
        return failWith(fmt::format("{}: the channel of '{}'", parts.where, readName(channel.field(), "")), sound.error());
    static constexpr std::array<std::string_view, 4> kMoving = {"translation", "rotation", "scale", "center"};
    if (type->pose && std::ranges::find(kMoving, channel.field()) != kMoving.end()) driven_.emplace(*target, "an animation");
    return create(frames);
}

}  // namespace tessera
