#include "server/tools/walls/PvxWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/tools/walls/WallAssembly.h"
#include "server/tools/walls/XmlText.h"

namespace tessera {
namespace {

constexpr double kPvxEyesM = 0.065;

constexpr StereoWord kPvxStereo[] = {
    {"Left", Eye::kLeft, StereoPacking::kNone},
    {"Right", Eye::kRight, StereoPacking::kNone},
    {"Crystal Eyes", Eye::kCenter, StereoPacking::kQuadBuffered},
    {"Red-Blue", Eye::kCenter, StereoPacking::kAnaglyphPlain},
    {"Anaglyph", Eye::kCenter, StereoPacking::kAnaglyph},
    {"Interlaced", Eye::kCenter, StereoPacking::kRows},
    {"Dresden", Eye::kCenter, StereoPacking::kColumns},
    {"Checkerboard", Eye::kCenter, StereoPacking::kCheckerboard},
    {"SplitViewportHorizontal", Eye::kCenter, StereoPacking::kSideBySide},
};

class PvxReading {
public:
    explicit PvxReading(const std::string& path) : path_(path), reading_(path), assembly_(reading_) {}

    Expected<ForeignWall> run(std::string_view text) {
        pugi::xml_document document;
        const Expected<pugi::xml_node> root = readXml(document, text, "pvx", path_);
        if (!root) return tl::unexpected(root.error());
        pugi::xml_node process = *root;
        for (const pugi::xml_node& child : childrenOf(*root, "Process")) {
            process = child;
            if (attributeOf(child, "Type") == "server") break;
        }
        if (const std::string on = attributeOf(childOf(process, "UseOffAxisProjection"), "Value");
            on == "0" || on == "false")
            reading_.note("UseOffAxisProjection is off there: corners were not used; here they are");
        eyesM_ = eyes(childOf(process, "EyeSeparation"), "Value", "EyeSeparation", kPvxEyesM);
        for (const pugi::xml_node& viewer : childrenOf(childOf(process, "IndependentViewers"), "Viewer"))
            ownEyesM_[attributeOf(viewer, "Id")] =
                eyes(viewer, "EyeSeparation", "Viewer " + attributeOf(viewer, "Id").substr(0, 20), eyesM_);
        const std::vector<pugi::xml_node> machines = childrenOf(process, "Machine");
        if (machines.empty()) reading_.refuse("", "there is no element Machine: each display is one");
        for (std::size_t i = 0; i < machines.size() && reading_.sound(); ++i) readMachine(machines[i], i);
        if (placed_ > 0) {
            reading_.note("the eyes are at the origin, as there: y = 0 is their height, not the floor");
            reading_.note("corners are taken as metres; where the room's unit is another one, scale them");
        } else if (reading_.sound()) {
            reading_.refuse("",
                            "no Machine has LowerLeft, LowerRight and UpperRight: a tiled display without corners does "
                            "not say where it stands; tessera-ctl new-wall makes a wall of its measures");
        }
        return assembly_.finish("ParaView");
    }

private:
    double eyes(const pugi::xml_node& node, const char* attribute, const std::string& place, double otherwise) {
        const std::string word = attributeOf(node, attribute);
        return word.empty() ? otherwise : reading_.number(place, word, 0, 1);
    }

    Vec3d corner(const pugi::xml_node& machine, const char* name, const std::string& place) {
        const std::string text = attributeOf(machine, name);
        Vec3d read = Vec3d::Zero();
        std::string_view rest = withoutBlanks(text);
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r\n,"));
            read[axis] = reading_.number(fmt::format("{}, {}", place, name), word, -kFarthestM, kFarthestM);
            rest.remove_prefix(word.size());
            while (!rest.empty() && std::string_view(" \t\r\n,").find(rest.front()) != std::string_view::npos)
                rest.remove_prefix(1);
        }
        if (!rest.empty()) reading_.refuse(place, fmt::format("{} has more than three numbers", name));
        return read;
    }

    /// WIDTHxHEIGHT+X+Y.
    void readGeometry(const pugi::xml_node& machine, const std::string& place, PlanePicture& picture) {
        const std::string geometry = attributeOf(machine, "Geometry");
        const std::string_view text = withoutBlanks(geometry);
        if (text.empty()) {
            const double shape = (picture.upperLeft - picture.lowerLeft).norm() /
                                 std::max(1e-6, (picture.lowerRight - picture.lowerLeft).norm());
            picture.widthPx = 1920;
            picture.heightPx = static_cast<int>(std::clamp(std::round(1920 * shape), 1.0, kMostPicturePx));
            reading_.note(
                fmt::format("{} has no Geometry: {} x {} pixels are taken; correct tile_width_px, tile_height_px",
                            place, picture.widthPx, picture.heightPx));
            return;
        }
        const std::size_t cross = text.find('x'), plus = text.find_first_of("+-");
        const std::string_view width = text.substr(0, cross);
        const std::string_view height =
            cross == std::string_view::npos
                ? ""
                : text.substr(cross + 1, plus == std::string_view::npos ? plus : plus - cross - 1);
        if (cross > plus && plus != std::string_view::npos)
            return reading_.refuse(place,
                                   fmt::format("Geometry \"{}\": WIDTHxHEIGHT+X+Y is needed", text.substr(0, 40)));
        const std::string where = place + ", Geometry (WIDTHxHEIGHT+X+Y)";
        picture.widthPx = static_cast<int>(reading_.number(where, width, 1, kMostPicturePx));
        picture.heightPx = static_cast<int>(reading_.number(where, height, 1, kMostPicturePx));
        if (plus != std::string_view::npos)
            reading_.note("where windows are on desktops is left out: say `monitor` in the outputs of tiles");
    }

    void readMachine(const pugi::xml_node& machine, std::size_t index) {
        const std::string named = attributeOf(machine, "Name");
        const std::string name = named.empty() ? fmt::format("machine{}", index) : named;
        const std::string place = fmt::format("Machine {} (\"{}\")", index + 1, name.substr(0, 40));
        PlanePicture picture{.name = name, .host = name, .user = userOf(attributeOf(machine, "ViewerId"))};
        std::size_t corners = 0;
        for (const char* key : {"LowerLeft", "LowerRight", "UpperRight"})
            if (!attributeOf(machine, key).empty()) ++corners;
        if (corners == 0) {
            reading_.note(place + " has no corners: it is left out");
            return;
        }
        if (corners != 3) return reading_.refuse(place, "LowerLeft, LowerRight and UpperRight are needed, all three");
        ++placed_;
        picture.lowerLeft = corner(machine, "LowerLeft", place);
        picture.lowerRight = corner(machine, "LowerRight", place);
        picture.upperLeft = picture.lowerLeft + corner(machine, "UpperRight", place) - picture.lowerRight;
        readGeometry(machine, place, picture);
        if (const std::string word = attributeOf(machine, "StereoType"); !word.empty()) {
            const auto known =
                std::ranges::find_if(kPvxStereo, [&](const StereoWord& one) { return word == one.word; });
            if (known != std::end(kPvxStereo)) {
                picture.eye = known->eye;
                picture.stereo = known->packing;
                if (word == "Red-Blue")
                    reading_.note(place + ": glasses for red and blue are taken as those for red and cyan");
                if (word == "Interlaced" || word == "Dresden" || word == "Checkerboard")
                    reading_.note(place + ": where eyes look exchanged, say `swap_eyes: true`");
            } else {
                reading_.note(fmt::format("{}: StereoType \"{}\" is not known: one picture for both eyes is drawn",
                                          place, word.substr(0, 40)));
            }
        }
        readDisplay(attributeOf(machine, "Environment"), name);
        assembly_.add(picture);
    }

    void readDisplay(const std::string& environment, const std::string& host) {
        if (environment.empty()) return;
        const std::string_view said(environment);
        const std::size_t at = said.find("DISPLAY=");
        const std::string_view display =
            at == std::string_view::npos ? "" : said.substr(at + 8, said.find_first_of(" ;", at + 8) - (at + 8));
        if (at != 0 || display.size() + 8 != said.size()) reading_.note("of Environment DISPLAY alone is carried over");
        if (display.empty()) return;
        assembly_.setMachine(host, host, std::string(display));
        reading_.note(
            "a Machine with a DISPLAY is taken as the machine of its Name: correct `ssh` where it is another");
    }

    const std::string& userOf(const std::string& viewerId) {
        const std::string id = viewerId.empty() ? "0" : viewerId;
        const auto [at, isNew] = users_.emplace(id, "");
        if (!isNew) return at->second;
        const auto own = ownEyesM_.find(id);
        // Two viewers stand at one place there, until a tracker moves them: each is a user of its own.
        User user{.name = id == "0" ? "viewer" : "viewer" + id};
        user.position = Vec3d::Zero();
        user.eyeSeparationMetres = own == ownEyesM_.end() ? eyesM_ : own->second;
        at->second = assembly_.addUser(user);
        return at->second;
    }

    std::string path_;
    WallReading reading_;
    WallAssembly assembly_;
    double eyesM_ = kPvxEyesM;
    std::map<std::string, double> ownEyesM_;
    std::map<std::string, std::string> users_;
    std::size_t placed_ = 0;
};

}  // namespace

Expected<ForeignWall> wallOfPvx(std::string_view text, const std::string& path) {
    return PvxReading(path).run(text);
}

}  // namespace tessera
