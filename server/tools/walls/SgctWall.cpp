#include "server/tools/walls/SgctWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/tools/walls/JsonNode.h"
#include "server/tools/walls/WallAssembly.h"

namespace tessera {
namespace {

constexpr double kSgctDistanceM = 10, kSgctEyesM = 0.06;

constexpr StereoWord kSgctStereo[] = {
    {.word = "active", .packing = StereoPacking::kQuadBuffered},
    {.word = "quadbuffer", .packing = StereoPacking::kQuadBuffered},
    {.word = "checkerboard", .packing = StereoPacking::kCheckerboard, .fromBelow = true},
    {.word = "checkerboard_inverted", .packing = StereoPacking::kCheckerboard, .swapped = true, .fromBelow = true},
    {.word = "anaglyph_red_cyan", .packing = StereoPacking::kAnaglyphPlain},
    {.word = "anaglyph_wimmer", .packing = StereoPacking::kAnaglyph},
    {.word = "vertical_interlaced", .packing = StereoPacking::kRows, .fromBelow = true},
    {.word = "vertical_interlaced_inverted", .packing = StereoPacking::kRows, .swapped = true, .fromBelow = true},
    {.word = "side_by_side", .packing = StereoPacking::kSideBySide},
    {.word = "side_by_side_inverted", .packing = StereoPacking::kSideBySide, .swapped = true},
    {.word = "top_bottom", .packing = StereoPacking::kTopBottom},
    {.word = "top_bottom_inverted", .packing = StereoPacking::kTopBottom, .swapped = true},
};

class SgctReading {
public:
    explicit SgctReading(const std::string& path) : reading_(path), assembly_(reading_) {}

    Expected<ForeignWall> run(std::string_view text) {
        const ApiExpected<Json> json = parseJson(text);
        if (!json) {
            reading_.refuse("", json.error().message);
            return tl::unexpected(*reading_.fault());
        }
        const JsonNode root(&*json, "", reading_);
        readUsers(root["users"]);
        const std::vector<JsonNode> nodes = root["nodes"].elements();
        if (nodes.empty()) root["nodes"].refuse("there is no node: a computer with windows is needed");
        for (const JsonNode& node : nodes) readNode(node);
        sayOfTheRest(root);
        return assembly_.finish("SGCT");
    }

private:
    Vec3d vector(const JsonNode& node, const Vec3d& otherwise) {
        if (!node.there()) return otherwise;
        return {node["x"].number(-kFarthestM, kFarthestM), node["y"].number(-kFarthestM, kFarthestM),
                node["z"].number(-kFarthestM, kFarthestM)};
    }

    Quatd rotation(const JsonNode& node) {
        if (!node.there()) return Quatd::Identity();
        if (node["w"].there()) {
            const Quatd q(node["w"].number(-1e6, 1e6), node["x"].number(-1e6, 1e6), node["y"].number(-1e6, 1e6),
                          node["z"].number(-1e6, 1e6));
            if (reading_.sound() && !(q.norm() > 1e-6)) node.refuse("a rotation of length 0 turns nothing");
            return reading_.sound() ? q.normalized() : Quatd::Identity();
        }
        const double yaw = radiansOf(node["yaw"].number(-3600, 3600)),
                     pitch = radiansOf(node["pitch"].number(-3600, 3600)),
                     roll = radiansOf(node["roll"].number(-3600, 3600));
        return Quatd(Eigen::AngleAxisd(-yaw, Vec3d::UnitY())) * Quatd(Eigen::AngleAxisd(pitch, Vec3d::UnitX())) *
               Quatd(Eigen::AngleAxisd(-roll, Vec3d::UnitZ()));
    }

    void readUsers(const JsonNode& users) {
        for (const JsonNode& node : users.elements()) {
            const std::string name = node["name"].text("");
            User user{.name = name.empty() ? "viewer" : name};
            user.eyeSeparationMetres = node["eyeseparation"].number(0, 1, kSgctEyesM);
            user.position = vector(node["pos"], Vec3d::Zero());
            user.orientation = rotation(node["orientation"]);
            if (node["matrix"].there()) readMatrix(node["matrix"], user);
            if (node["tracking"].there())
                reading_.note(fmt::format(
                    "user \"{}\": its tracker is left out; name one in the wall (`trackers`, `head`)", user.name));
            const std::string known = assembly_.addUser(user);
            if (users_.empty()) firstUser_ = known;
            users_.emplace(name, known);
        }
        if (users_.empty()) {
            reading_.note("there is no user: the eyes are taken to be at the origin");
            firstUser_ = assembly_.addUser({.name = "viewer",
                                            .position = Vec3d::Zero(),
                                            .orientation = Quatd::Identity(),
                                            .eyeSeparationMetres = kSgctEyesM});
        }
    }

    /// Column by column; where the head is, and how it is turned.
    void readMatrix(const JsonNode& node, User& user) {
        const std::vector<JsonNode> numbers = node.elements();
        if (numbers.size() != 16) return node.refuse("16 numbers are needed");
        Mat3d turn;
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row)
                turn(row, column) = numbers[static_cast<std::size_t>(4 * column + row)].number(-1e6, 1e6);
        for (std::size_t row = 0; row < 3; ++row)
            user.position[static_cast<int>(row)] = numbers[12 + row].number(-kFarthestM, kFarthestM);
        if ((turn * turn.transpose() - Mat3d::Identity()).norm() > 1e-4 || turn.determinant() < 0)
            return node.refuse("a head is turned and moved, not scaled or mirrored: give pos and orientation instead");
        user.orientation = Quatd(turn).normalized();
    }

    void readNode(const JsonNode& node) {
        const std::string address = node["address"].text();
        // Several nodes of one address are told apart by their ports.
        const std::string host = addresses_.insert(address).second
                                     ? address
                                     : fmt::format("{}-{:g}", address, node["port"].number(0, 65535, 0));
        assembly_.setMachine(host, address);
        const std::vector<JsonNode> windows = node["windows"].elements();
        if (windows.empty()) reading_.note(fmt::format("node \"{}\" has no window: it is left out", address));
        for (const JsonNode& window : windows) readWindow(window, host);
    }

    void readWindow(const JsonNode& window, const std::string& host) {
        if (!window["draw3d"].flag(true) || window["blitwindowid"].number(-1, 127, -1) >= 0) {
            reading_.note(fmt::format("{}: a window that draws no scene of its own is left out", window.place()));
            return;
        }
        const JsonNode res = window["res"].there() ? window["res"] : window["size"];
        const double width = res["x"].number(1, kMostPicturePx), height = res["y"].number(1, kMostPicturePx);
        for (const char* key : {"pos", "monitor"})
            if (window[key].there())
                reading_.note("where windows are on desktops is left out: say `monitor` in the outputs of tiles");
        for (const char* key : {"scalablemesh", "spout", "ndi"})
            if (window[key].there()) reading_.note(fmt::format("{}: {} is left out", window.place(), key));
        if (window["viewports"].elements().empty())
            reading_.note(fmt::format("{}: a window without viewports is left out", window.place()));
        for (const JsonNode& viewport : window["viewports"].elements()) {
            PlanePicture picture{.name = window["name"].text(host), .host = host, .user = {}};
            readStereo(window, viewport, picture);
            picture.flipX = window["mirrorx"].flag(false);
            picture.flipY = window["mirrory"].flag(false);
            const JsonNode size = viewport["size"];
            picture.widthPx = static_cast<int>(std::lround(width * size["x"].number(0, 1, 1)));
            picture.heightPx = static_cast<int>(std::lround(height * size["y"].number(0, 1, 1)));
            if (picture.stereo != StereoPacking::kNone && packingOf(window)->fromBelow && picture.heightPx % 2 == 0)
                picture.swapEyes = !picture.swapEyes;
            if (reading_.sound() && (picture.widthPx < 1 || picture.heightPx < 1))
                viewport.refuse("it has no pixels: see the size of the viewport and of its window");
            readViewport(viewport, picture);
        }
    }

    const StereoWord* packingOf(const JsonNode& window) {
        const std::string word = window["stereo"].text("none");
        for (const StereoWord& known : kSgctStereo)
            if (word == known.word) return &known;
        if (word != "none" && word != "no_stereo")
            reading_.note(fmt::format("{}: stereo \"{}\" is not known here: one picture for both eyes is drawn",
                                      window.place(), word.substr(0, 40)));
        return nullptr;
    }

    void readStereo(const JsonNode& window, const JsonNode& viewport, PlanePicture& picture) {
        const std::string eye = viewport["eye"].text("center");
        if (eye == "left" || eye == "right") {
            picture.eye = eye == "left" ? Eye::kLeft : Eye::kRight;
            return;
        }
        if (eye != "center") viewport["eye"].refuse("center, left or right are possible");
        if (const StereoWord* known = packingOf(window)) {
            picture.stereo = known->packing;
            picture.swapEyes = known->swapped;
        }
    }

    void readViewport(const JsonNode& viewport, PlanePicture& picture) {
        const std::string user = viewport["user"].text("");
        const auto known = users_.find(user);
        if (known != users_.end()) {
            picture.user = known->second;
        } else {
            if (!user.empty()) viewport["user"].refuse("there is no such user: add one to users");
            picture.user = firstUser_;
        }
        for (const auto& [key, what] : {std::pair{"mesh", "its warp mesh"},
                                        {"blendmask", "its blend mask"},
                                        {"blacklevelmask", "its mask of black"},
                                        {"overlay", "its overlay"}})
            if (viewport[key].there())
                reading_.note(fmt::format("{}: {} is left out; outputs of tiles take a `warp` and a `blend_picture`",
                                          viewport.place(), what));
        const JsonNode projection = viewport["projection"];
        const std::string type = projection.there() ? projection["type"].text() : "none";
        if (type == "PlanarProjection" || type == "TextureMappedProjection") {
            if (type == "TextureMappedProjection")
                reading_.note(fmt::format("{}: the texture that is mapped is left out: the plane is drawn as it is",
                                          projection.place()));
            return readPlanar(projection, picture);
        }
        if (type == "ProjectionPlane") {
            picture.lowerLeft = vector(required(projection["lowerleft"]), {});
            picture.upperLeft = vector(required(projection["upperleft"]), {});
            picture.lowerRight = picture.lowerLeft + vector(required(projection["upperright"]), {}) - picture.upperLeft;
            assembly_.add(picture);
            return;
        }
        reading_.note(fmt::format("{}: {} is left out, as tiles are planes here", projection.place(),
                                  type == "none" ? "a viewport without a projection" : type.substr(0, 40)));
    }

    const JsonNode& required(const JsonNode& corner) {
        if (!corner.there()) corner.refuse("this corner is missing: three are needed");
        return corner;
    }

    void readPlanar(const JsonNode& projection, PlanePicture& picture) {
        const JsonNode fov = projection["fov"];
        const auto side = [&](const char* key, const char* whole) {
            const std::optional<double> half =
                fov[whole].there() ? std::optional(fov[whole].number(0.01, 178) / 2) : std::nullopt;
            return std::tan(radiansOf(fov[key].number(-89, 89, half)));
        };
        const double left = -side("left", "hfov"), right = side("right", "hfov"), down = -side("down", "vfov"),
                     up = side("up", "vfov");
        if (reading_.sound() && !(left < right && down < up)) fov.refuse("it has no area");
        const double distance =
            projection["distance"].number(0.001, kFarthestM, fov["distance"].number(0.001, kFarthestM, kSgctDistanceM));
        const Quatd turn = rotation(projection["orientation"]);
        const Vec3d offset = vector(projection["offset"], Vec3d::Zero());
        const auto corner = [&](double x, double y) -> Vec3d {
            return turn * Vec3d(distance * x, distance * y, -distance) + offset;
        };
        picture.lowerLeft = corner(left, down);
        picture.lowerRight = corner(right, down);
        picture.upperLeft = corner(left, up);
        assembly_.add(picture);
    }

    void sayOfTheRest(const JsonNode& root) {
        if (root["scene"].there())
            reading_.note(
                "scene: where the scene is and how it is scaled is left out; move the view (tessera-ctl view)");
        if (root["trackers"].there()) reading_.note("trackers are left out; name them in the wall (`trackers`)");
        if (root["capture"].there() || root["settings"].there())
            reading_.note("capture and settings are left out: they describe the program, not the wall");
    }

    WallReading reading_;
    WallAssembly assembly_;
    std::map<std::string, std::string> users_;  ///< their names there and here; "": the one without a name
    std::string firstUser_;
    std::set<std::string> addresses_;
};

}  // namespace

Expected<ForeignWall> wallOfSgct(std::string_view text, const std::string& path) {
    return SgctReading(path).run(text);
}

}  // namespace tessera
