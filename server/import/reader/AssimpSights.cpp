#include "server/import/reader/AssimpSights.h"

#include <assimp/camera.h>
#include <assimp/light.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/import/reader/AssimpMotion.h"

namespace tessera {
namespace {

using std::numbers::pi;

/// What renderers of these formats burn out, too, where they stand in a picture without an exposure.
constexpr double kDazzling = 2.5;
/// Width to height of the walls that Tessera ships: of cameras that say one angle and no shape.
constexpr double kWallAspect = 16.0 / 9;

/// What a format means, where assimp leaves it to the format.
struct Ways {
    bool alongNode = false;   ///< lights and cameras look along their node's -Z; what assimp says is its own default
    bool nodeStands = false;  ///< the node has the place, which assimp says twice
    bool target = false;      ///< a light's direction is the point that it shines at
    bool falloff = false;     ///< the numbers of the falloff are the file's own
    bool collada = false;     ///< see where it is asked
    double cone = 1;          ///< of the angle that assimp has, what lies to one side of the axis
};

Ways waysOf(const std::string& ending) {
    if (ending == ".ase" || ending == ".ask") return {.alongNode = true, .cone = 0.5};
    if (ending == ".lws" || ending == ".mot") return {.alongNode = true};
    if (ending == ".ogex") return {.alongNode = true};
    if (ending == ".3ds" || ending == ".prj") return {.nodeStands = true, .cone = 0.5};
    if (ending == ".dae" || ending == ".zae" || ending == ".xml")
        return {.falloff = true, .collada = true, .cone = 0.5};
    if (ending == ".fbx") return {.falloff = true, .cone = 0.5};
    if (ending == ".sib") return {.target = true, .falloff = true};
    if (ending == ".blend" || ending == ".assbin") return {.falloff = true};
    return {};
}

Vec3d vectorOf(const aiVector3D& v) {
    return {v.x, v.y, v.z};
}

/// Looks along -Z; a direction or an up that is none becomes some.
Affine3d lookingAlong(const Vec3d& at, const Vec3d& direction, const Vec3d& up) {
    const Vec3d back = direction.norm() > 1e-12 ? Vec3d(-direction.normalized()) : Vec3d(Vec3d::UnitZ());
    Vec3d right = up.cross(back);
    if (!(right.norm() > 1e-6 * up.norm())) right = back.unitOrthogonal();
    Affine3d map = Affine3d::Identity();
    map.linear().col(0) = right.normalized();
    map.linear().col(1) = back.cross(map.linear().col(0));
    map.linear().col(2) = back;
    map.translation() = at;
    return map;
}

bool isSound(const Affine3d& map) {
    return map.matrix().cwiseAbs().maxCoeff() <= 1e15;
}

double scaleOf(const Affine3d& map) {
    return std::cbrt(std::abs(map.linear().determinant()));
}

Box boundsOf(const aiMesh& mesh) {
    Box box;
    for (unsigned v = 0; mesh.mVertices != nullptr && v < mesh.mNumVertices; ++v)
        if (const Vec3d at = vectorOf(mesh.mVertices[v]); at.allFinite()) box.extend(at);
    return box;
}

Box boundsOf(const aiScene& scene) {
    std::vector<Box> meshes;
    for (unsigned m = 0; m < scene.mNumMeshes; ++m) meshes.push_back(boundsOf(*scene.mMeshes[m]));
    Box bounds;
    std::vector<std::pair<const aiNode*, Affine3d>> open = {{scene.mRootNode, Affine3d::Identity()}};
    while (!open.empty()) {
        const auto [node, world_T_parent] = open.back();
        open.pop_back();
        const Affine3d world_T_node = world_T_parent * affineOf(node->mTransformation);
        if (!world_T_node.matrix().allFinite()) continue;
        for (unsigned m = 0; m < node->mNumMeshes; ++m)
            if (const Box& box = meshes[node->mMeshes[m]]; !box.empty()) bounds.extend(box.transformed(world_T_node));
        for (unsigned c = 0; c < node->mNumChildren; ++c) open.emplace_back(node->mChildren[c], world_T_node);
    }
    return bounds;
}

template <typename Message>
void setLight(Message& message, const Vec3d& color, double intensity) {
    message.mutable_color()->set_r(static_cast<float>(color.x()));
    message.mutable_color()->set_g(static_cast<float>(color.y()));
    message.mutable_color()->set_b(static_cast<float>(color.z()));
    message.set_intensity(static_cast<float>(intensity));
}

template <typename Message>
void setFalloff(Message& message, const Vec3d& falloff) {
    message.mutable_attenuation()->set_x(falloff.x());
    message.mutable_attenuation()->set_y(falloff.y());
    message.mutable_attenuation()->set_z(falloff.z());
}

}  // namespace

AssimpSights::AssimpSights(const aiScene& source, PlainScene& scene, std::string lowerEnding)
    : scene_(scene), ending_(std::move(lowerEnding)) {
    for (unsigned i = 0; i < source.mNumCameras; ++i)
        cameras_.emplace(source.mCameras[i]->mName.C_Str(), source.mCameras[i]);
    for (unsigned i = 0; i < source.mNumLights; ++i)
        lights_.emplace(source.mLights[i]->mName.C_Str(), source.mLights[i]);
    count_ = std::max<std::size_t>(lights_.size(), 1);
    if (cameras_.empty() && lights_.empty()) return;
    bounds_ = boundsOf(source);
    // Assimp scales the root of what is not in metres.
    if (const double unit = scaleOf(affineOf(source.mRootNode->mTransformation)); unit > 1e-9 && unit < 1e9)
        unit_ = unit;
}

bool AssimpSights::isNamed(const aiNode& node) const {
    return cameras_.contains(node.mName.C_Str()) || lights_.contains(node.mName.C_Str());
}

void AssimpSights::leaveOut(const std::string& what, const char* name) {
    leftOut_[what].emplace_back(foreignName(name, "one without a name"));
}

void AssimpSights::add(const aiNode& node, const Affine3d& world_T_node, proto::scene::Node& placed) {
    const std::string name = node.mName.C_Str();
    const auto [firstCamera, lastCamera] = cameras_.equal_range(name);
    for (auto at = firstCamera; at != lastCamera; ++at) addCamera(*at->second, world_T_node, placed);
    cameras_.erase(firstCamera, lastCamera);
    const auto [firstLight, lastLight] = lights_.equal_range(name);
    for (auto at = firstLight; at != lastLight; ++at) addLight(*at->second, world_T_node, placed);
    lights_.erase(firstLight, lastLight);
}

void AssimpSights::addCamera(const aiCamera& camera, const Affine3d& world_T_node, proto::scene::Node& placed) {
    const char* const name = camera.mName.C_Str();
    const Ways ways = waysOf(ending_);
    // Where key frames place it, and Quick3D's always.
    if (const bool turned = vectorOf(camera.mLookAt) != Vec3d::UnitZ();
        ending_ == ".q3s" || ending_ == ".q3o" || (ways.nodeStands && !turned))
        return leaveOut("cameras of which assimp does not tell where they look are left out", name);
    Affine3d node_T_eye = Affine3d::Identity();
    if (!ways.alongNode)
        node_T_eye =
            lookingAlong(vectorOf(camera.mPosition), vectorOf(camera.mLookAt).normalized(), vectorOf(camera.mUp));
    double width = camera.mHorizontalFOV;
    // Of a Collada camera without a name assimp has no angle, and takes its own default to be in degrees.
    const float unsaid = 0.25F * std::numbers::pi_v<float>;
    if (ways.collada && std::abs(width - unsaid * pi / 180) < 1e-6) {
        leaveOut("cameras of which assimp does not tell the angle are 45 degrees wide", name);
        width = unsaid;
    }
    const double aspect = camera.mAspect > 1e-3F && camera.mAspect < 1e3F ? double{camera.mAspect} : kWallAspect;
    const Affine3d world_T_eye = world_T_node * node_T_eye;
    if (!isSound(world_T_eye)) return leaveOut("cameras that stand nowhere are left out", name);
    ModelCamera said{.name = foreignName(name, "camera"), .fieldOfView = std::nullopt, .height = 0};
    if (camera.mOrthographicWidth > 0)
        said.height = 2.0 * camera.mOrthographicWidth / aspect * scaleOf(world_T_eye);
    else
        said.fieldOfView = width > 0 && width < pi ? 2 * std::atan(std::tan(width / 2) / aspect) : 0;
    proto::scene::Node* at = &placed;
    if (!node_T_eye.isApprox(Affine3d::Identity(), 1e-9))
        at = addPlacedNode([&] { return placed.add_node(); }, "eye", node_T_eye);
    if (!addModelCamera(said, world_T_eye, bounds_, scene_, *at))
        leaveOut("cameras that can show nothing are left out", name);
}

void AssimpSights::addLight(const aiLight& light, const Affine3d& world_T_node, proto::scene::Node& placed) {
    const char* const name = light.mName.C_Str();
    const Ways ways = waysOf(ending_);
    if (light.mType == aiLightSource_AMBIENT)
        return leaveOut("ambient lights are left out; the studio or the scene's surroundings stand in", name);
    const aiColor3D& diffuse = light.mColorDiffuse;
    Vec3d color(diffuse.r, diffuse.g, diffuse.b);
    if (!(color.minCoeff() >= 0 && color.maxCoeff() <= kUtmostLight))
        return leaveOut("lights whose colour is no number from 0 to 1e15 are left out", name);
    if (light.mType == aiLightSource_UNDEFINED || color.maxCoeff() == 0)
        return leaveOut("lights of which assimp does not tell a kind or a colour are left out", name);
    // Of scenes older than LightWave 6 colours are bytes.
    if (ending_ == ".lws" && color.maxCoeff() > 16) color /= 255;
    // Neutral File Format: n lights together are as bright as sqrt(n) / 2 (E. Haines, "A proposal for standard graphics
    // environments", 1987).
    if (ending_ == ".nff") color *= 0.5 / std::sqrt(static_cast<double>(count_));
    // The colour carries the strength.
    const double intensity = std::max(color.maxCoeff(), 1.0);
    color /= intensity;

    const bool flat = light.mType == aiLightSource_AREA, directional = light.mType == aiLightSource_DIRECTIONAL;
    bool spot = light.mType == aiLightSource_SPOT;
    const Vec3d stands = ways.nodeStands ? Vec3d(Vec3d::Zero()) : vectorOf(light.mPosition);
    Vec3d direction = vectorOf(light.mDirection);
    if (ways.target) direction -= vectorOf(light.mPosition);
    if (ways.alongNode || !(direction.norm() > 1e-12)) direction = -Vec3d::UnitZ();
    if (ways.nodeStands && spot && vectorOf(light.mDirection) == Vec3d::UnitZ()) {
        scene_.note(fmt::format("spots of which assimp does not tell where they shine shine to all sides: {}",
                                foreignName(name, "light")));
        spot = false;
    }
    const Affine3d node_T_light = spot || directional || flat ? lookingAlong(stands, direction, Vec3d::UnitY())
                                                              : Affine3d(Eigen::Translation3d(stands));
    const Affine3d world_T_light = world_T_node * node_T_light;
    if (!isSound(world_T_light)) return leaveOut("lights that stand nowhere are left out", name);

    // Lengths are in the file's own unit.
    Vec3d falloff = kNoFalloff;
    const Vec3d said(light.mAttenuationConstant, light.mAttenuationLinear / unit_,
                     light.mAttenuationQuadratic / (unit_ * unit_));
    if (ways.falloff && !directional && said.minCoeff() >= 0 && said.maxCoeff() <= 1e12) falloff = said;
    // An FBX says a distance at which light is halved. Within, assimp has it grow without bound.
    if (ending_ == ".fbx") falloff = Vec3d(1, falloff.y() / 2, falloff.z() / 2);
    if (falloff.isZero()) falloff = kNoFalloff;
    light_.add(intensity, falloff, world_T_light.translation(), bounds_);

    proto::scene::Node& node =
        *addPlacedNode([&] { return placed.add_node(); }, foreignName(name, "light"), node_T_light);
    if (directional) return setLight(*node.mutable_directional_light(), color, intensity);
    if (!spot && !flat) {
        setLight(*node.mutable_point_light(), color, intensity);
        return setFalloff(*node.mutable_point_light(), falloff);
    }
    proto::scene::SpotLight& cone = *node.mutable_spot_light();
    setLight(cone, color, intensity);
    setFalloff(cone, falloff);
    const auto degrees = [&](double angle) {
        return std::isfinite(angle) ? std::clamp(angle * ways.cone * 180 / pi, 0.0, 90.0) : 90.0;
    };
    double outer = flat ? 90 : degrees(light.mAngleOuterCone), inner = flat ? 0 : degrees(light.mAngleInnerCone);
    // Assimp's outer angle of Collada is where a power of the cosine is small; the file's own is the inner one.
    if (ways.collada) outer = inner;
    cone.set_outer_angle_deg(static_cast<float>(std::max(outer, 0.1)));
    cone.set_inner_angle_deg(static_cast<float>(std::min(inner, outer)));
    if (flat) scene_.note("flat lights shine from their middle");
}

void AssimpSights::finish() {
    for (const auto& [name, camera] : cameras_)
        leaveOut("cameras that no node is called after are left out", name.c_str());
    for (const auto& [name, light] : lights_)
        leaveOut("lights that no node is called after are left out", name.c_str());
    for (const auto& [what, names] : leftOut_)
        scene_.note(names.size() == 1 ? fmt::format("{}: {}", what, names.front())
                                      : fmt::format("{}: {} and {} more", what, names.front(), names.size() - 1));
    light_.addExposure(scene_, kDazzling);
}

}  // namespace tessera
