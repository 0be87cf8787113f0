#include "server/tools/walls/NdisplayWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/LowerCase.h"
#include "server/tools/walls/JsonNode.h"
#include "server/tools/walls/WallAssembly.h"

namespace tessera {
namespace {

constexpr double kFarthestCm = 100 * kFarthestM, kNdisplayEyesCm = 6.4;
constexpr int kDeepestXform = 64;  ///< xforms in xforms

/// A place in Unreal's coordinates.
struct UnrealPose {
    Mat3d turn = Mat3d::Identity();  ///< its columns: where X, Y and Z point
    Vec3d place = Vec3d::Zero();     ///< centimetres
    [[nodiscard]] UnrealPose in(const UnrealPose& parent) const {
        return {parent.turn * turn, parent.turn * place + parent.place};
    }
    [[nodiscard]] Vec3d at(const Vec3d& local) const { return turn * local + place; }
};

/// Unreal's rotators: the X axis points where pitch and yaw lead, roll turns about it, clockwise for who looks along.
Mat3d unrealRotator(double pitch, double yaw, double roll) {
    const double cp = std::cos(pitch), sp = std::sin(pitch), cy = std::cos(yaw), sy = std::sin(yaw),
                 cr = std::cos(roll), sr = std::sin(roll);
    Mat3d turn;
    turn.col(0) = Vec3d(cp * cy, cp * sy, sp);
    turn.col(1) = Vec3d(sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, -sr * cp);
    turn.col(2) = Vec3d(-(cr * sp * cy + sr * sy), cy * sr - cr * sp * sy, cr * cp);
    return turn;
}

/// X ahead, Y right, Z up to x right, y up, -z ahead: a mirror, as the one is left-handed.
Vec3d unrealAxes(const Vec3d& unreal) {
    return {unreal.y(), unreal.z(), -unreal.x()};
}

Quatd unrealTurn(const Mat3d& unreal) {
    Mat3d turn;
    turn.col(0) = unrealAxes(unreal.col(1));
    turn.col(1) = unrealAxes(unreal.col(2));
    turn.col(2) = -unrealAxes(unreal.col(0));
    return Quatd(turn).normalized();
}

class NdisplayReading {
public:
    explicit NdisplayReading(const std::string& path) : reading_(path), assembly_(reading_) {}

    Expected<ForeignWall> run(std::string_view text) {
        const ApiExpected<Json> json = parseJson(text);
        if (!json) {
            reading_.refuse("",
                            json.error().message +
                                "; before Unreal 4.27 files were no JSON: open it in its editor and export it again");
            return tl::unexpected(*reading_.fault());
        }
        const JsonNode file(&*json, "", reading_);
        const JsonNode root = file["nDisplay"];
        if (!root.there()) root.refuse("this object is missing: it is no .ndisplay of Unreal 4.27 or 5");
        const JsonNode scene = root["scene"];
        for (const auto& [id, node] : scene["xforms"].members()) xforms_.emplace(id, node);
        for (const auto& [id, node] : scene["cameras"].members()) cameras_.emplace_back(id, node);
        for (const auto& [id, node] : scene["screens"].members()) screens_.emplace(id, node);
        const auto nodes = root["cluster"]["nodes"].members();
        if (nodes.empty()) root["cluster"]["nodes"].refuse("there is no node: a computer with a window is needed");
        for (const auto& [id, node] : nodes) readNode(id, node);
        reading_.note("stereo is said on Unreal's command line: where it is wanted, give tiles for both eyes");
        return assembly_.finish("nDisplay");
    }

private:
    /// In the world, through all its parents.
    UnrealPose poseOf(const JsonNode& node) {
        UnrealPose pose = poseInParent(node);
        std::string parent = node["parentId"].text("");
        for (int depth = 0; !parent.empty() && reading_.sound(); ++depth) {
            const auto at = xforms_.find(parent);
            if (at == xforms_.end()) {
                node["parentId"].refuse(fmt::format("there is no xform \"{}\"", parent.substr(0, 60)));
            } else if (depth == kDeepestXform) {
                node["parentId"].refuse("its parents go round in a circle, or lie deeper than 64");
            } else {
                const JsonNode& outer = at->second;
                pose = pose.in(poseInParent(outer));
                parent = outer["parentId"].text("");
            }
        }
        return pose;
    }

    UnrealPose poseInParent(const JsonNode& node) {
        const JsonNode location = node["location"], rotation = node["rotation"];
        const auto degrees = [&](const char* key) { return radiansOf(rotation[key].number(-3600, 3600, 0)); };
        return {unrealRotator(degrees("pitch"), degrees("yaw"), degrees("roll")),
                {location["x"].number(-kFarthestCm, kFarthestCm, 0), location["y"].number(-kFarthestCm, kFarthestCm, 0),
                 location["z"].number(-kFarthestCm, kFarthestCm, 0)}};
    }

    void readNode(const std::string& id, const JsonNode& node) {
        assembly_.setMachine(id, node["host"].text(""));
        if (node["renderHeadless"].flag(false)) {
            reading_.note(fmt::format("node \"{}\" draws without a window: it is left out", id));
            return;
        }
        if (node["window"].there() || node["fullScreen"].flag(false))
            reading_.note("where windows are on desktops is left out: say `monitor` in the outputs of tiles");
        if (node["outputRemap"]["bEnable"].flag(false))
            reading_.note(fmt::format("node \"{}\": outputRemap is left out; outputs of tiles take a `warp`", id));
        const auto viewports = node["viewports"].members();
        if (viewports.empty()) reading_.note(fmt::format("node \"{}\" has no viewport: it is left out", id));
        for (const auto& [name, viewport] : viewports) readViewport(id, node, viewport);
    }

    void readViewport(const std::string& host, const JsonNode& node, const JsonNode& viewport) {
        const JsonNode policy = viewport["projectionPolicy"];
        const std::string type = lowerCase(policy["type"].text());
        if (type != "simple") {
            reading_.note(
                fmt::format("{}: projectionPolicy \"{}\" is left out: \"simple\" is read, which shows a screen",
                            viewport.place(), type.substr(0, 40)));
            return;
        }
        const std::string screenId = policy["parameters"]["screen"].text();
        const auto at = screens_.find(screenId);
        if (at == screens_.end())
            return policy["parameters"]["screen"].refuse(
                fmt::format("there is no screen \"{}\" in scene.screens", screenId.substr(0, 60)));
        if (viewport["overscan"]["bEnabled"].flag(false))
            reading_.note(fmt::format("{}: overscan is left out", viewport.place()));
        const JsonNode region = viewport["region"].there() ? viewport["region"] : node["window"];
        PlanePicture picture{.name = screenId, .host = host, .user = {}};
        picture.widthPx = static_cast<int>(std::lround(region["w"].number(1, kMostPicturePx)));
        picture.heightPx = static_cast<int>(std::lround(region["h"].number(1, kMostPicturePx)));
        readCamera(viewport["camera"], picture);

        const JsonNode& screen = at->second;
        const double halfWidth = screen["size"]["width"].number(0.1, kFarthestCm) / 2,
                     halfHeight = screen["size"]["height"].number(0.1, kFarthestCm) / 2;
        const UnrealPose pose = poseOf(screen);
        const auto corner = [&](double right, double up) -> Vec3d { return unrealAxes(pose.at({0, right, up})) / 100; };
        picture.lowerLeft = corner(-halfWidth, -halfHeight);
        picture.lowerRight = corner(halfWidth, -halfHeight);
        picture.upperLeft = corner(-halfWidth, halfHeight);
        assembly_.add(picture);
    }

    void readCamera(const JsonNode& wanted, PlanePicture& picture) {
        const std::string id = wanted.text("");
        const auto at = std::ranges::find_if(cameras_, [&](const auto& one) { return id.empty() || one.first == id; });
        if (at == cameras_.end())
            return wanted.refuse(cameras_.empty()
                                     ? std::string("there is no camera in scene.cameras: it is the head")
                                     : fmt::format("there is no camera \"{}\" in scene.cameras", id.substr(0, 60)));
        const JsonNode& node = at->second;
        const std::string eye = lowerCase(node["stereoOffset"].text("none"));
        if (eye == "left" || eye == "right")
            picture.eye = (eye == "left") != node["swapEyes"].flag(false) ? Eye::kLeft : Eye::kRight;
        const UnrealPose pose = poseOf(node);
        User user{.name = at->first};
        user.position = unrealAxes(pose.place) / 100;
        user.orientation = unrealTurn(pose.turn);
        user.eyeSeparationMetres = node["interpupillaryDistance"].number(0, 100, kNdisplayEyesCm) / 100;
        picture.user = assembly_.addUserOnce(user);
    }

    WallReading reading_;
    WallAssembly assembly_;
    std::map<std::string, JsonNode> xforms_, screens_;
    std::vector<std::pair<std::string, JsonNode>> cameras_;
};

}  // namespace

Expected<ForeignWall> wallOfNdisplay(std::string_view text, const std::string& path) {
    return NdisplayReading(path).run(text);
}

}  // namespace tessera
