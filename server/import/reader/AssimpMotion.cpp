#include "server/import/reader/AssimpMotion.h"

#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/Decompositions.h"

namespace tessera {
namespace {

constexpr double kLatestSeconds = 1e9;

/// rotation · scale as near to the matrix as they come, and whether that is all of it, but for what files round.
bool splitParts(const Affine3d& map, Vec3d& translation, Quatd& rotation, Vec3d& scale) {
    const Mat3d linear = map.linear();
    const SingularValues svd = singularValuesOf(linear);
    scale = linear.colwise().norm();
    // Columns at right angles tell the rotation by themselves; of others, and of flat ones, the nearest rotation does.
    Mat3d turn = svd.u * svd.v.transpose();
    if (scale.minCoeff() > 0) {
        const Mat3d columns = linear * scale.cwiseInverse().asDiagonal();
        if ((columns.transpose() * columns - Mat3d::Identity()).cwiseAbs().maxCoeff() < 1e-5) turn = columns;
    }
    if (turn.determinant() < 0) {
        turn.col(0) = -turn.col(0);
        scale.x() = -scale.x();
    }
    rotation = Quatd(turn).normalized();
    translation = map.translation();
    return (rotation.toRotationMatrix() * scale.asDiagonal() - linear).cwiseAbs().maxCoeff() <=
           1e-3 * std::max(linear.cwiseAbs().maxCoeff(), 1e-30);
}

bool isTriangles(const aiMesh& mesh) {
    return (mesh.mPrimitiveTypes & (aiPrimitiveType_TRIANGLE | aiPrimitiveType_POLYGON)) != 0;
}

/// What a vertex can be brought back from: anything else makes points of surfaces, or nothing at all.
bool isSoundBind(const Affine3d& bind) {
    if (!(bind.matrix().cwiseAbs().maxCoeff() <= 1e15)) return false;
    const double size = bind.linear().colwise().norm().maxCoeff();
    return std::abs(bind.linear().determinant()) > 1e-12 * size * size * size;
}

std::string shownName(const std::string& text) {
    std::string shown = text.substr(0, 80);
    for (char& c : shown)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '_';
    return shown;
}

/// Of one target: times in ticks, ascending, and weights there.
using MorphCurve = std::vector<std::pair<double, double>>;

/// A key speaks of some targets, and those of FBX of the few whose own curve has a key then: between them the others go
/// on.
std::vector<MorphCurve> morphCurves(const aiMeshMorphAnim& source, std::size_t targets) {
    std::vector<MorphCurve> curves(targets);
    for (unsigned k = 0; k < source.mNumKeys; ++k)
        for (unsigned i = 0; i < source.mKeys[k].mNumValuesAndWeights; ++i)
            if (const unsigned target = source.mKeys[k].mValues[i];
                target < targets && std::isfinite(source.mKeys[k].mTime))
                curves[target].emplace_back(source.mKeys[k].mTime, source.mKeys[k].mWeights[i]);
    for (MorphCurve& curve : curves) std::ranges::stable_sort(curve, {}, &std::pair<double, double>::first);
    return curves;
}

double weightAt(const MorphCurve& curve, double time) {
    const auto next = std::ranges::upper_bound(curve, time, {}, &std::pair<double, double>::first);
    if (next == curve.begin()) return next->second;
    const auto before = next - 1;
    if (next == curve.end() || before->first == time) return before->second;
    return before->second + (next->second - before->second) * ((time - before->first) / (next->first - before->first));
}

}  // namespace

Affine3d affineOf(const aiMatrix4x4& m) {
    Affine3d map = Affine3d::Identity();
    map.matrix().row(0) << m.a1, m.a2, m.a3, m.a4;
    map.matrix().row(1) << m.b1, m.b2, m.b3, m.b4;
    map.matrix().row(2) << m.c1, m.c2, m.c3, m.c4;
    return map;
}

AssimpMotion::AssimpMotion(const aiScene& source, PlainScene& scene, std::string lowerEnding)
    : source_(source), scene_(scene), ending_(std::move(lowerEnding)), animations_(scene) {
    // In the order in which assimp itself looks for names.
    std::vector<const aiNode*> open = {source.mRootNode};
    while (!open.empty()) {
        const aiNode* node = open.back();
        open.pop_back();
        if (!nodes_.emplace(node->mName.C_Str(), node).second) ambiguous_.insert(node->mName.C_Str());
        for (unsigned i = node->mNumChildren; i > 0; --i) open.push_back(node->mChildren[i - 1]);
    }
    for (unsigned m = 0; m < source.mNumMeshes; ++m)
        for (unsigned b = 0; b < source.mMeshes[m]->mNumBones; ++b) name(source.mMeshes[m]->mBones[b]->mName.C_Str());
    for (unsigned a = 0; a < source.mNumAnimations; ++a)
        for (unsigned c = 0; c < source.mAnimations[a]->mNumChannels; ++c) {
            const char* named = source.mAnimations[a]->mChannels[c]->mNodeName.C_Str();
            name(named);
            if (const aiNode* node = find(named)) animated_.insert(node);
        }
}

const aiNode* AssimpMotion::find(const char* name) const {
    const auto found = nodes_.find(name);
    return found == nodes_.end() ? nullptr : found->second;
}

void AssimpMotion::name(const char* named) {
    const aiNode* node = find(named);
    if (!node || !keys_.try_emplace(node, lastKey_ + 1).second) return;
    ++lastKey_;
    if (ambiguous_.contains(named))
        odd("names of bones or channels that several nodes have mean the first of them", named);
}

void AssimpMotion::odd(const std::string& what, const std::string& where) {
    auto& [count, first] = odd_[what];
    if (count++ == 0) first = shownName(where);
}

proto::scene::Node* AssimpMotion::place(const std::function<proto::scene::Node*()>& make, const std::string& name,
                                        const aiNode& node, const Affine3d& parent_T_node) {
    proto::scene::Node* placed = nullptr;
    if (animated_.contains(&node)) {
        Vec3d translation, scale;
        Quatd rotation;
        if (!splitParts(parent_T_node, translation, rotation, scale))
            odd("nodes that are animated and sheared lose the shear", node.mName.C_Str());
        placed = make();
        placed->set_name(name);
        setTransform(*placed->mutable_transform(), translation, rotation, scale);
    } else {
        placed = addPlacedNode(make, name, parent_T_node);
    }
    if (const auto key = keys_.find(&node); key != keys_.end()) placed->set_key(key->second);
    return placed;
}

bool AssimpMotion::deforms(const aiMesh& mesh) {
    if (mesh.mNumBones == 0 && mesh.mNumAnimMeshes == 0) return false;
    if (!isTriangles(mesh) || mesh.mVertices == nullptr) {
        if (mesh.mNumBones > 0) scene_.note("points and lines that have a skin stay at rest");
        if (mesh.mNumAnimMeshes > 0) scene_.note("morph targets of points and lines are shown at rest");
        return false;
    }
    if (mesh.mNumBones > 0xfff0) {
        odd("meshes with more than 65520 bones stay at rest", mesh.mName.C_Str());
        return false;
    }
    return true;
}

const AssimpMotion::Bound& AssimpMotion::bound(unsigned number) {
    const auto [place, isNew] = bounds_.try_emplace(number);
    if (!isNew) return place->second;
    const aiMesh& mesh = *source_.mMeshes[number];
    if (mesh.mNumBones > 0) bindJoints(mesh, place->second);
    if (mesh.mNumAnimMeshes > 0) bindMorphs(mesh, place->second);
    return place->second;
}

void AssimpMotion::bindJoints(const aiMesh& mesh, Bound& bound) {
    std::vector<std::vector<Influence>> influences(mesh.mNumVertices);
    std::vector<float> rows;
    std::map<const aiNode*, std::pair<std::uint32_t, Affine3d>> known;
    const auto add = [&](const aiNode* node, const std::string& name, const Affine3d& bind) {
        bound.joints.push_back(node);
        bound.names.push_back(name);
        appendMatrixRows(rows, bind);
        return static_cast<std::uint32_t>(bound.joints.size() - 1);
    };
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t rest = kNone;
    const auto atRest = [&] { return rest == kNone ? rest = add(nullptr, "at rest", Affine3d::Identity()) : rest; };
    for (unsigned b = 0; b < mesh.mNumBones; ++b) {
        const aiBone& bone = *mesh.mBones[b];
        const aiNode* node = find(bone.mName.C_Str());
        Affine3d bind = affineOf(bone.mOffsetMatrix);
        std::uint32_t joint = 0;
        if (!node || !isSoundBind(bind)) {
            odd(node ? "bones whose offset matrix is singular or no numbers move nothing"
                     : "bones that no node is called after move nothing",
                bone.mName.C_Str());
            joint = atRest();
        } else if (const auto before = known.find(node); before == known.end()) {
            joint = add(node, bone.mName.C_Str(), bind);
            known.emplace(node, std::pair(joint, bind));
        } else {
            // A skin names a joint once: the second counts where it says the same.
            joint = before->second.first;
            if (!(before->second.second.matrix() - bind.matrix()).isZero(1e-6 * bind.matrix().cwiseAbs().maxCoeff()))
                odd("bones of one name in one mesh have the offset matrix of the first", bone.mName.C_Str());
        }
        for (unsigned w = 0; w < bone.mNumWeights; ++w) {
            if (bone.mWeights[w].mVertexId >= mesh.mNumVertices) {
                odd("weights of bones for vertices that do not exist are left out", bone.mName.C_Str());
                continue;
            }
            influences[bone.mWeights[w].mVertexId].push_back({bone.mWeights[w].mWeight, joint});
        }
    }
    // Whoever follows nobody stays where the mesh is.
    const auto follows = [](const Influence& one) { return std::isfinite(one.weight) && one.weight > 0; };
    for (const std::vector<Influence>& all : influences)
        if (std::ranges::none_of(all, follows)) {
            atRest();
            break;
        }
    SkinInfluences strongest(scene_);
    for (std::vector<Influence>& all : influences) strongest.addVertex(all, rest == kNone ? 0 : rest);
    proto::scene::Skin written;
    strongest.write(written);
    bound.indices = written.joint_indices_blob();
    bound.weights = written.joint_weights_blob();
    bound.binds = scene_.addBlob(bytesOfNumbers(rows));
}

/// What is added to the mesh, target after target: assimp says where vertices get to.
std::vector<float> AssimpMotion::morphDeltas(const aiMesh& mesh, bool normals) {
    const aiVector3D* base = normals ? mesh.mNormals : mesh.mVertices;
    std::vector<float> deltas;
    deltas.reserve(std::size_t{3} * mesh.mNumAnimMeshes * mesh.mNumVertices);
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
        const aiAnimMesh& target = *mesh.mAnimMeshes[t];
        const aiVector3D* to = normals ? target.mNormals : target.mVertices;
        const std::size_t from = deltas.size();
        deltas.resize(from + std::size_t{3} * mesh.mNumVertices);
        if (!to || !base) continue;
        if (target.mNumVertices != mesh.mNumVertices) {
            odd("morph targets of another number of vertices than their mesh move nothing", target.mName.C_Str());
            continue;
        }
        for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
            const aiVector3D delta = to[v] - base[v];
            for (unsigned c = 0; c < 3; ++c) deltas[from + std::size_t{3} * v + c] = delta[c];
        }
        const std::span<float> all(deltas.data() + from, std::size_t{3} * mesh.mNumVertices);
        if (holdsSkinNumbers(all)) continue;
        odd("morph targets with numbers that are not finite or beyond 1e15 move nothing", target.mName.C_Str());
        std::ranges::fill(all, 0.0f);
    }
    return deltas;
}

void AssimpMotion::bindMorphs(const aiMesh& mesh, Bound& bound) {
    if (std::size_t{mesh.mNumAnimMeshes} * mesh.mNumVertices > kMaxMorphVertices)
        return odd("meshes of more than a hundred million vertices in morph targets have none", mesh.mName.C_Str());
    bound.morphPositions = scene_.addBlob(bytesOfNumbers(morphDeltas(mesh, false)));
    const auto turns = [](const aiAnimMesh* target) { return target->mNormals != nullptr; };
    if (mesh.HasNormals() && std::any_of(mesh.mAnimMeshes, mesh.mAnimMeshes + mesh.mNumAnimMeshes, turns))
        bound.morphNormals = scene_.addBlob(bytesOfNumbers(morphDeltas(mesh, true)));
    // Of FBX assimp makes a target of each step of a channel; only such have weights of their own, the channel's.
    bound.stepsBetween =
        ending_ == ".fbx" && std::any_of(mesh.mAnimMeshes, mesh.mAnimMeshes + mesh.mNumAnimMeshes,
                                         [](const aiAnimMesh* target) { return target->mWeight != 1.0f; });
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
        float weight = mesh.mAnimMeshes[t]->mWeight;
        // Of FBX assimp says 1 of each target that has no steps between, whatever the file does.
        if (bound.stepsBetween || (ending_ == ".fbx" && weight == 1.0f)) {
            scene_.note("how far morph targets of FBX are at rest is not known: they are at 0");
            weight = 0;
        }
        if (!(std::abs(weight) <= 1e15f))
            scene_.note("weights of morph targets that are no numbers within 1e15 count as zero");
        bound.morphWeights.push_back(std::abs(weight) <= 1e15f ? weight : 0.0f);
    }
}

void AssimpMotion::addSkin(proto::scene::Node& child, proto::scene::Node& placed, const aiNode& node, unsigned mesh,
                           const std::string& name) {
    const Bound& parts = bound(mesh);
    proto::scene::Skin& skin = *child.mutable_skin();
    skin.set_mesh(name);
    for (std::size_t j = 0; j < parts.joints.size(); ++j) {
        if (parts.joints[j]) {
            skin.add_joint_key(keys_.at(parts.joints[j]));
            continue;
        }
        proto::scene::Node* stays = placed.add_node();
        stays->set_name(parts.names[j]);
        stays->mutable_transform();
        stays->set_key(++lastKey_);
        skin.add_joint_key(lastKey_);
    }
    skin.set_inverse_binds_blob(parts.binds);
    skin.set_joint_indices_blob(parts.indices);
    skin.set_joint_weights_blob(parts.weights);
    if (parts.morphPositions == 0) return;
    skin.set_morph_positions_blob(parts.morphPositions);
    skin.set_morph_normals_blob(parts.morphNormals);
    for (const float weight : parts.morphWeights) skin.add_weight(weight);
    child.set_key(++lastKey_);
    morphed_.emplace(node.mName.C_Str(), Morphed{lastKey_, mesh});
    const aiString& called = source_.mMeshes[mesh]->mName;
    if (called.length > 0 && called != node.mName) morphed_.emplace(called.C_Str(), Morphed{lastKey_, mesh});
}

/// In the order of time, without what makes no sense. Two keys of one time are a jump: the later one comes a moment
/// later.
template <typename Key, typename Read>
AssimpMotion::Track AssimpMotion::track(const Key* keys, unsigned count, double ticksPerSecond, std::size_t width,
                                        Read&& read) {
    Track result;
    result.width = width;
    if (!keys) return result;
    std::vector<unsigned> order;
    for (unsigned k = 0; k < count; ++k) order.push_back(k);
    if (!std::is_sorted(order.begin(), order.end(),
                        [&](unsigned a, unsigned b) { return keys[a].mTime < keys[b].mTime; })) {
        std::erase_if(order, [&](unsigned k) { return !std::isfinite(keys[k].mTime); });
        std::ranges::stable_sort(order, [&](unsigned a, unsigned b) { return keys[a].mTime < keys[b].mTime; });
        scene_.note("keys of an animation that are not in the order of time are played in it");
    }
    std::size_t unsound = 0;
    std::vector<double> value(width);
    for (std::size_t i = 0; i < order.size(); ++i) {
        double seconds = keys[order[i]].mTime / ticksPerSecond - shift_;
        read(keys[order[i]], value.data());
        if (!(std::abs(seconds) <= kLatestSeconds) ||
            !std::ranges::all_of(value, [](double v) { return std::abs(v) <= 1e15; })) {
            ++unsound;
            continue;
        }
        const bool again = !result.times.empty() && seconds <= result.times.back();
        if (again && i + 1 < order.size() && keys[order[i + 1]].mTime == keys[order[i]].mTime)
            continue;  // of more than two the first and the last
        if (again) seconds = std::nextafter(result.times.back(), kLatestSeconds * 2);
        result.times.push_back(seconds);
        result.values.insert(result.values.end(), value.begin(), value.end());
    }
    if (unsound + (count - order.size()) > 0)
        scene_.note(
            "keys of an animation with numbers that are not finite, beyond 1e15 or later than 1e9 s are left out");
    return result;
}

void AssimpMotion::keep(Track track, std::uint32_t target, const char* field) {
    if (track.times.empty()) return;
    if (!driven_.insert({target, field}).second)
        return odd("fields that an animation drives twice follow the first channel", field);
    bool same = true;  // writers of files say every frame of what never moves
    for (std::size_t i = track.width; i < track.values.size() && same; ++i)
        same = track.values[i] == track.values[i - track.width];
    if (same) {
        track.times.resize(1);
        track.values.resize(track.width);
    }
    track.target = target;
    track.field = field;
    tracks_.push_back(std::move(track));
}

/// An animation lasts until its last key: here one is added where the file says that it goes on.
void AssimpMotion::holdUntilTheEnd() {
    if (tracks_.empty()) return;
    Track& latest = *std::ranges::max_element(tracks_, {}, [](const Track& track) { return track.times.back(); });
    if (!(latest.times.back() < length_)) return;
    latest.times.push_back(length_);
    latest.values.insert(latest.values.end(), latest.values.end() - static_cast<std::ptrdiff_t>(latest.width),
                         latest.values.end());
}

proto::scene::Animation AssimpMotion::written() {
    proto::scene::Animation animation;
    const Track* before = nullptr;
    std::uint32_t times = 0;
    for (const Track& track : tracks_) {
        if (!before || track.times != before->times) times = scene_.addBlob(bytesOfNumbers(track.times));
        before = &track;
        proto::scene::Channel& message = *animation.add_channel();
        message.set_target_key(track.target);
        message.set_field(track.field);
        message.set_times_blob(times);
        message.set_values_blob(scene_.addBlob(bytesOfNumbers(track.values)));
        message.set_interpolation(proto::scene::Channel::LINEAR);
    }
    return animation;
}

void AssimpMotion::addChannel(const aiNodeAnim& source, double ticksPerSecond) {
    const aiNode* node = find(source.mNodeName.C_Str());
    if (!node) return odd("channels of an animation that name no node are left out", source.mNodeName.C_Str());
    if (std::max({source.mNumPositionKeys, source.mNumRotationKeys, source.mNumScalingKeys}) > kMaxKeysPerChannel)
        return odd("channels of an animation with more than a million keys are left out", source.mNodeName.C_Str());
    const auto vector = [](const aiVectorKey& key, double* to) {
        to[0] = key.mValue.x, to[1] = key.mValue.y, to[2] = key.mValue.z;
    };
    const auto quaternion = [this](const aiQuatKey& key, double* to) {
        to[0] = key.mValue.w, to[1] = key.mValue.x, to[2] = key.mValue.y, to[3] = key.mValue.z;
        mendRotationKey(scene_, std::span<double, 4>(to, 4));
    };
    const std::uint32_t target = keys_.at(node);
    const auto add = [&](Track track, const char* field) {
        if (track.times.empty()) return;
        // What assimp calls the default is what files do not say: then, too, the first and the last key hold.
        const bool early = track.times.front() > 0 && source.mPreState >= aiAnimBehaviour_LINEAR;
        const bool late = track.times.back() < length_ && source.mPostState >= aiAnimBehaviour_LINEAR;
        if (early || late)
            odd("channels that would go on before their first or after their last key stand still there",
                source.mNodeName.C_Str());
        keep(std::move(track), target, field);
    };
    add(track(source.mPositionKeys, source.mNumPositionKeys, ticksPerSecond, 3, vector), "translation");
    add(track(source.mRotationKeys, source.mNumRotationKeys, ticksPerSecond, 4, quaternion), "rotation");
    add(track(source.mScalingKeys, source.mNumScalingKeys, ticksPerSecond, 3, vector), "scale");
}

void AssimpMotion::addMorphChannel(const aiMeshMorphAnim& source, double ticksPerSecond) {
    std::string named = source.mName.C_Str();
    auto range = morphed_.equal_range(named);
    // FBX: the node's name, a star, the number of its mesh.
    if (range.first == range.second) range = morphed_.equal_range(named.substr(0, named.rfind('*')));
    if (range.first == range.second)
        return odd("channels of weights that name no mesh with morph targets are left out", named);
    if (source.mNumKeys > kMaxKeysPerChannel)
        return odd("channels of an animation with more than a million keys are left out", named);
    for (auto part = range.first; part != range.second; ++part) {
        if (bounds_.at(part->second.mesh).stepsBetween) {
            odd("channels of weights of FBX meshes whose morph targets have steps between are left out: which steps "
                "belong together is not known",
                named);
            continue;
        }
        const std::vector<float>& atRest = bounds_.at(part->second.mesh).morphWeights;
        const std::vector<MorphCurve> curves = morphCurves(source, atRest.size());
        const auto weights = [&](const aiMeshMorphKey& key, double* to) {
            for (std::size_t t = 0; t < atRest.size(); ++t)
                to[t] = curves[t].empty() ? static_cast<double>(atRest[t]) : weightAt(curves[t], key.mTime);
            for (unsigned i = 0; i < key.mNumValuesAndWeights; ++i) {
                if (key.mValues[i] < atRest.size())
                    to[key.mValues[i]] = key.mWeights[i];
                else
                    odd("weights of morph targets that do not exist are left out", named);
            }
        };
        if (std::size_t{source.mNumKeys} * atRest.size() > 50 * kMaxKeysPerChannel) {
            odd("channels of an animation with more than a million keys are left out", named);
            continue;
        }
        keep(track(source.mKeys, source.mNumKeys, ticksPerSecond, atRest.size(), weights), part->second.key, "weights");
    }
}

void AssimpMotion::addAnimation(const aiAnimation& source, std::size_t number) {
    const std::string name =
        source.mName.length > 0 ? shownName(source.mName.C_Str()) : fmt::format("animation {}", number);
    double ticksPerSecond = source.mTicksPerSecond;
    if (!(ticksPerSecond > 0) || !std::isfinite(ticksPerSecond)) {
        scene_.note(ticksPerSecond == 0
                        ? std::string("the file says no pace of its animations: 25 ticks a second are taken")
                        : fmt::format("animation {} is of {} ticks a second: 25 are taken", name, ticksPerSecond));
        ticksPerSecond = 25;
    }
    // It begins at 0 s at the latest, and ends with its last key or where the file says, whichever is later.
    double first = 0, last = 0;
    const auto look = [&](const auto* keys, unsigned count) {
        for (unsigned k = 0; keys && k < count; ++k) {
            const double seconds = keys[k].mTime / ticksPerSecond;
            if (!(std::abs(seconds) <= kLatestSeconds)) continue;
            first = std::min(first, seconds);
            last = std::max(last, seconds);
        }
    };
    for (unsigned c = 0; c < source.mNumChannels; ++c) {
        look(source.mChannels[c]->mPositionKeys, source.mChannels[c]->mNumPositionKeys);
        look(source.mChannels[c]->mRotationKeys, source.mChannels[c]->mNumRotationKeys);
        look(source.mChannels[c]->mScalingKeys, source.mChannels[c]->mNumScalingKeys);
    }
    for (unsigned c = 0; c < source.mNumMorphMeshChannels; ++c)
        look(source.mMorphMeshChannels[c]->mKeys, source.mMorphMeshChannels[c]->mNumKeys);
    if (first < 0) scene_.note(fmt::format("animation {} begins {:.3g} s before 0: it is moved to 0", name, -first));
    // Of a Half-Life model assimp takes the frames of a second for those of all it has.
    const double told = ending_ == ".mdl" ? last : source.mDuration / ticksPerSecond;
    shift_ = first;
    length_ = std::min(std::max(last, told <= kLatestSeconds ? told : 0) - first, kLatestSeconds);
    driven_.clear();
    tracks_.clear();
    for (unsigned c = 0; c < source.mNumChannels; ++c) addChannel(*source.mChannels[c], ticksPerSecond);
    for (unsigned c = 0; c < source.mNumMorphMeshChannels; ++c)
        addMorphChannel(*source.mMorphMeshChannels[c], ticksPerSecond);
    if (source.mNumMeshChannels > 0) scene_.note("animations that swap whole meshes are left out");
    holdUntilTheEnd();
    animations_.add(name, written());
}

void AssimpMotion::finish() {
    for (unsigned a = 0; a < source_.mNumAnimations; ++a) addAnimation(*source_.mAnimations[a], a);
    animations_.finish();
    for (const auto& [what, seen] : odd_)
        scene_.note(fmt::format("{} ({}, the first of '{}')", what, seen.first, seen.second));
}

}  // namespace tessera
