#include "server/tools/walls/CoverWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <utility>

#include "server/tools/walls/WallAssembly.h"
#include "server/tools/walls/XmlText.h"

namespace tessera {
namespace {

constexpr double kFarthestMm = 1000 * kFarthestM, kCoverEyesMm = 64;
constexpr int kMostCoverChannels = 50;  ///< of a computer; as many as OpenCOVER takes
constexpr std::size_t kMostCoverHosts = 256, kMostCoverAttributes = 32;
/// Elements and attributes in sections of single computers, each as often as it names computers.
constexpr std::size_t kMostCoverWords = 1'000'000;
constexpr const char* kCoverSettings[] = {"NumScreens", "NumChannels", "NumPBOs",    "ViewerPosition",
                                          "Stereo",     "StereoMode",  "WorldAngle", "Input"};
constexpr std::pair<const char*, const char*> kCoverLists[] = {{"ScreenConfig", "Screen"},
                                                               {"ChannelConfig", "Channel"},
                                                               {"ViewportConfig", "Viewport"},
                                                               {"WindowConfig", "Window"}};

/// What is said for one computer: "ScreenConfig.Screen:0" → its attributes.
using CoverSettings = std::map<std::string, std::map<std::string, std::string>>;

std::vector<std::string> coverNames(std::string_view list) {
    std::vector<std::string> names;
    while (!list.empty()) {
        const std::size_t comma = list.find(',');
        if (const std::string_view name = withoutBlanks(list.substr(0, comma)); !name.empty()) names.emplace_back(name);
        list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
    }
    return names;
}

bool isCoverOn(std::string_view word) {
    return sameWord(word, "on") || sameWord(word, "true") || word == "1" || sameWord(word, "yes");
}

constexpr StereoWord kCoverStereo[] = {
    {"LEFT", Eye::kLeft, StereoPacking::kNone},
    {"LEFT_EYE", Eye::kLeft, StereoPacking::kNone},
    {"RIGHT", Eye::kRight, StereoPacking::kNone},
    {"RIGHT_EYE", Eye::kRight, StereoPacking::kNone},
    {"ANAGLYPHIC", Eye::kCenter, StereoPacking::kAnaglyphPlain},
    {"QUAD_BUFFER", Eye::kCenter, StereoPacking::kQuadBuffered},
    {"HORIZONTAL_SPLIT", Eye::kCenter, StereoPacking::kSideBySide},
    {"VERTICAL_SPLIT", Eye::kCenter, StereoPacking::kTopBottom},
    {"STIPPLE", Eye::kCenter, StereoPacking::kColumns},
    {"VERTICAL_INTERLACE", Eye::kCenter, StereoPacking::kColumns},
    {"HORIZONTAL_INTERLACE", Eye::kCenter, StereoPacking::kRows},
    {"CHECKERBOARD", Eye::kCenter, StereoPacking::kCheckerboard},
};

/// X right, Y ahead, Z up, in millimetres.
Vec3d coverPlace(const Vec3d& cover) {
    return Vec3d(cover.x(), cover.z(), -cover.y()) / 1000;
}

/// r about Y, then p about X, then h about Z.
Quatd coverTurn(double h, double p, double r) {
    return Quatd(Eigen::AngleAxisd(radiansOf(h), Vec3d::UnitZ())) *
           Quatd(Eigen::AngleAxisd(radiansOf(p), Vec3d::UnitX())) *
           Quatd(Eigen::AngleAxisd(radiansOf(r), Vec3d::UnitY()));
}

class CoverReading {
public:
    explicit CoverReading(const std::string& path) : path_(path), reading_(path), assembly_(reading_) {}

    Expected<ForeignWall> run(std::string_view text) {
        pugi::xml_document document;
        const Expected<pugi::xml_node> root = readXml(document, text, "COCONFIG", path_);
        if (!root) return tl::unexpected(root.error());
        root_ = *root;
        for (const pugi::xml_node& child : root_.children())
            if (sameWord(child.name(), "INCLUDE"))
                reading_.note(
                    "INCLUDE: the files that it names are not read: put what they say of screens in this one");
        const std::vector<std::string> hosts = hostsOf();
        const CoverSettings ofAll = settingsOfAll();
        words_ = 0;
        for (const std::string& host : hosts) {
            if (!reading_.sound()) break;
            const CoverSettings own = settingsOf(host);
            if (words_ > kMostCoverWords)
                reading_.refuse("", "too much is said of single computers: say once in GLOBAL what holds for many");
            else
                readHost(host, own, ofAll);
        }
        if (placed_ == 0 && reading_.sound())
            reading_.refuse("",
                            "no computer has a Screen in COVER/ScreenConfig: its width, height and origin are needed");
        return assembly_.finish("OpenCOVER");
    }

private:
    /// The computers of the cluster, as MultiPC names them; else all that LOCAL names; else one.
    std::vector<std::string> hostsOf() {
        std::vector<std::string> together, local;
        std::set<std::string> known;
        for (const pugi::xml_node& section : root_.children()) {
            const pugi::xml_node sync = childOf(childOf(childOf(section, "COVER"), "MultiPC"), "SyncMode");
            for (std::string& name : coverNames(attributeOf(sync, "hosts")))
                if (known.insert(name).second) together.push_back(std::move(name));
            if (!sameWord(section.name(), "LOCAL")) continue;
            std::vector<std::string> names = coverNames(attributeOf(section, "HOST"));
            if (names.empty()) names = {""};
            for (const std::string& name : names) {
                if (!local_.contains(name) && !name.empty()) local.push_back(name);
                local_[name].push_back(section);
            }
        }
        std::vector<std::string> hosts = !together.empty() ? together
                                         : !local.empty()  ? local
                                                           : std::vector<std::string>{"cover"};
        if (hosts.size() > kMostCoverHosts)
            reading_.refuse("", fmt::format("more than {} computers: split the wall", kMostCoverHosts));
        return hosts;
    }

    /// What is of use here.
    void takeSection(const pugi::xml_node& section, CoverSettings& settings) {
        const auto take = [&](const pugi::xml_node& node, const std::string& key) {
            if (attributeOf(node, "ARCH").starts_with("win")) return;
            std::map<std::string, std::string>& said = settings[key];
            for (const pugi::xml_attribute& attribute : node.attributes()) {
                ++words_;
                if (said.size() < kMostCoverAttributes || said.contains(attribute.name()))
                    said[attribute.name()] = attribute.value();
            }
        };
        for (const pugi::xml_node& child : section.children()) {
            ++words_;
            const std::string_view name = child.name();
            if (std::ranges::find(kCoverSettings, name) != std::end(kCoverSettings)) take(child, child.name());
            const auto list = std::ranges::find(kCoverLists, name, &std::pair<const char*, const char*>::first);
            if (list == std::end(kCoverLists)) continue;
            for (const pugi::xml_node& one : child.children()) {
                ++words_;
                if (std::string_view(one.name()) != list->second) continue;
                const std::optional<double> number = numberOfWord(attributeOf(one, "name"));
                if (number && *number >= 0 && *number <= kMostCoverChannels && *number == std::floor(*number))
                    take(one, fmt::format("{}.{}:{:g}", name, list->second, *number));
            }
        }
    }

    /// What holds for all, from what counts least.
    CoverSettings settingsOfAll() {
        CoverSettings settings;
        for (const pugi::xml_node& cover : childrenOf(root_, "COVER")) takeSection(cover, settings);
        for (const char* kind : {"GLOBAL", "CLUSTER"})
            for (const pugi::xml_node& section : childrenOf(root_, kind))
                for (const pugi::xml_node& cover : childrenOf(section, "COVER")) takeSection(cover, settings);
        takeLocal("", settings);
        return settings;
    }
    CoverSettings settingsOf(const std::string& host) {
        CoverSettings settings;
        takeLocal(host, settings);
        return settings;
    }
    void takeLocal(const std::string& name, CoverSettings& settings) {
        for (const pugi::xml_node& section : local_[name])
            for (const pugi::xml_node& cover : childrenOf(section, "COVER")) takeSection(cover, settings);
    }

    /// An attribute of what has been said for one computer, else for all.
    class CoverLookup {
    public:
        CoverLookup(const CoverSettings& own, const CoverSettings& ofAll, std::string host, WallReading& reading)
            : settings_{&own, &ofAll}, host_(std::move(host)), reading_(reading) {}
        [[nodiscard]] bool has(const std::string& key) const {
            return settings_[0]->contains(key) || settings_[1]->contains(key);
        }
        [[nodiscard]] std::string word(const std::string& key, const std::string& attribute) const {
            for (const CoverSettings* settings : settings_)
                if (const auto at = settings->find(key); at != settings->end())
                    if (const auto value = at->second.find(attribute); value != at->second.end()) return value->second;
            return {};
        }
        [[nodiscard]] double number(const std::string& key, const std::string& attribute, double otherwise,
                                    double least, double most) const {
            const std::string text = word(key, attribute);
            if (text.empty()) return otherwise;
            return reading_.number(fmt::format("{} of {}, for host \"{}\"", attribute, key, host_), withoutBlanks(text),
                                   least, most);
        }

    private:
        const CoverSettings* settings_[2];
        std::string host_;
        WallReading& reading_;
    };

    void readHost(const std::string& host, const CoverSettings& own, const CoverSettings& ofAll) {
        const CoverLookup said(own, ofAll, host, reading_);
        const bool stereo = isCoverOn(said.word("Stereo", "value"));
        User user{.name = "viewer"};
        const Vec3d eyes(said.number("ViewerPosition", "x", 0, -kFarthestMm, kFarthestMm),
                         said.number("ViewerPosition", "y", -2000, -kFarthestMm, kFarthestMm),
                         said.number("ViewerPosition", "z", 30, -kFarthestMm, kFarthestMm));
        user.position = coverPlace(eyes);
        if (said.word("Stereo", "separation").starts_with("AUTO"))
            reading_.note("Stereo: a separation AUTO is taken as 64 mm");
        else if (stereo)
            user.eyeSeparationMetres = said.number("Stereo", "separation", kCoverEyesMm, 0, 1000) / 1000;
        if (!stereo) user.eyeSeparationMetres = 0;
        if (said.number("WorldAngle", "value", 0, -3600, 3600) != 0) reading_.note("WorldAngle is left out");
        if (said.has("Input")) reading_.note("trackers are left out; name them in the wall (`trackers`, `head`)");
        if (said.number("NumPBOs", "value", 0, 0, 1000) > 0)
            reading_.note("pictures that are drawn into buffers first (PBOs) are taken as if they were drawn at once");
        const int screens = static_cast<int>(said.number("NumScreens", "value", 1, 0, kMostCoverChannels));
        const int channels = static_cast<int>(said.number("NumChannels", "value", screens, 0, kMostCoverChannels));
        for (int channel = 0; channel < channels && reading_.sound(); ++channel)
            readChannel(host, said, channel, stereo, user);
    }

    void readChannel(const std::string& host, const CoverLookup& said, int index, bool stereo, const User& user) {
        const std::string channel = fmt::format("ChannelConfig.Channel:{}", index);
        const int screenIndex = static_cast<int>(said.number(channel, "screenIndex", index, 0, kMostCoverChannels));
        const std::string screen = fmt::format("ScreenConfig.Screen:{}", screenIndex);
        if (!said.has(screen)) {
            // Who draws nothing needs no screen: a computer that others are told from.
            if (said.has(channel))
                reading_.note(
                    fmt::format("host \"{}\": there is no Screen {}: its channel is left out", host, screenIndex));
            return;
        }
        ++placed_;
        const std::string comment = said.word(screen, "comment");
        PlanePicture picture{
            .name = comment.empty() ? fmt::format("screen{}", screenIndex) : comment, .host = host, .user = {}};
        if (const std::string frustum = said.word(screen, "frustum"); !frustum.empty())
            return reading_.refuse(fmt::format("Screen {} of host \"{}\"", screenIndex, host),
                                   "a frustum instead of origin, width and height is not read: give those");
        const Vec3d center(said.number(screen, "originX", 0, -kFarthestMm, kFarthestMm),
                           said.number(screen, "originY", 0, -kFarthestMm, kFarthestMm),
                           said.number(screen, "originZ", 0, -kFarthestMm, kFarthestMm));
        const double halfWidth = said.number(screen, "width", 2000, 1, kFarthestMm) / 2,
                     halfHeight = said.number(screen, "height", 1500, 1, kFarthestMm) / 2;
        const Quatd turn = coverTurn(said.number(screen, "h", 0, -3600, 3600), said.number(screen, "p", 0, -3600, 3600),
                                     said.number(screen, "r", 0, -3600, 3600));
        const auto corner = [&](double right, double up) -> Vec3d {
            return coverPlace(center + turn * Vec3d(right, 0, up));
        };
        picture.lowerLeft = corner(-halfWidth, -halfHeight);
        picture.lowerRight = corner(halfWidth, -halfHeight);
        picture.upperLeft = corner(-halfWidth, halfHeight);
        readPixels(said, channel, index, host, picture, halfHeight / halfWidth);
        readStereo(said, channel, stereo, picture);
        if (said.number(channel, "viewerOffset", 0, -kFarthestMm, kFarthestMm) != 0)
            reading_.note(fmt::format("host \"{}\": the viewerOffset of channel {} is left out", host, index));
        picture.user = assembly_.addUserOnce(user);
        // A name of a computer is all that is known of it.
        if (host != "cover") assembly_.setMachine(host, host);
        assembly_.add(picture);
    }

    /// A viewport's edges are parts of its window up to 1, and pixels beyond.
    void readPixels(const CoverLookup& said, const std::string& channel, int index, const std::string& host,
                    PlanePicture& picture, double shape) {
        const std::string viewport = fmt::format("ViewportConfig.Viewport:{:g}",
                                                 said.number(channel, "viewportIndex", index, 0, kMostCoverChannels));
        const std::string with = said.word(viewport, "windowIndex").empty() ? channel : viewport;
        const std::string window =
            fmt::format("WindowConfig.Window:{:g}", said.number(with, "windowIndex", index, -1, kMostCoverChannels));
        const double windowWidth = said.number(window, "width", 0, 1, kMostPicturePx),
                     windowHeight = said.number(window, "height", 0, 1, kMostPicturePx);
        for (const char* key : {"distortMesh", "blendingTexture"})
            if (!said.word(viewport, key).empty())
                reading_.note(fmt::format(
                    "host \"{}\": {} is left out; outputs of tiles take a `warp` and a `blend_picture`", host, key));
        const auto extent = [&](const char* first, const char* last, const char* size, double whole) {
            const auto part = [&](double value) { return value > 1 && whole > 0 ? value / whole : value; };
            if (!said.word(viewport, last).empty())
                return part(said.number(viewport, last, 1, 0, kMostPicturePx)) -
                       part(said.number(viewport, first, 0, 0, kMostPicturePx));
            return part(said.number(viewport, size, 1, 0, kMostPicturePx));
        };
        const double width = extent("left", "right", "width", windowWidth) * windowWidth;
        const double height = extent("bottom", "top", "height", windowHeight) * windowHeight;
        picture.widthPx = static_cast<int>(std::lround(width));
        picture.heightPx = static_cast<int>(std::lround(height));
        if (windowWidth > 0 && windowHeight > 0) {
            if (reading_.sound() && (picture.widthPx < 1 || picture.heightPx < 1))
                reading_.refuse(fmt::format("{} of host \"{}\"", viewport, host),
                                "it has no pixels: see its width and height");
            return;
        }
        picture.widthPx = 1920;
        picture.heightPx = static_cast<int>(std::clamp(std::round(1920 * shape), 1.0, kMostPicturePx));
        reading_.note(fmt::format(
            "host \"{}\": {} has no width and height: {} x {} pixels are taken; correct tile_width_px, tile_height_px",
            host, window, picture.widthPx, picture.heightPx));
    }

    void readStereo(const CoverLookup& said, const std::string& channel, bool on, PlanePicture& picture) {
        std::string word = said.word(channel, "stereoMode");
        if (word.empty()) word = said.word("StereoMode", "value");
        if (word.empty() || sameWord(word, "MONO") || sameWord(word, "NONE")) return;
        const auto known =
            std::ranges::find_if(kCoverStereo, [&](const StereoWord& one) { return sameWord(word, one.word); });
        if (known == std::end(kCoverStereo)) {
            reading_.note(
                fmt::format("stereoMode \"{}\" is not known: one picture for both eyes is drawn", word.substr(0, 40)));
            return;
        }
        picture.eye = known->eye;
        if (on) picture.stereo = known->packing;
        if (on && known->packing != StereoPacking::kNone)
            reading_.note(fmt::format("stereoMode {}: where eyes look exchanged, say `swap_eyes: true`", word));
    }

    std::string path_;
    WallReading reading_;
    WallAssembly assembly_;
    pugi::xml_node root_;
    std::map<std::string, std::vector<pugi::xml_node>> local_;  ///< sections by computer; "": those of any
    std::size_t placed_ = 0, words_ = 0;  ///< screens that have a place; elements and attributes that were looked at
};

}  // namespace

Expected<ForeignWall> wallOfCover(std::string_view text, const std::string& path) {
    return CoverReading(path).run(text);
}

}  // namespace tessera
