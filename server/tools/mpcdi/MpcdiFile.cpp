#include "server/tools/mpcdi/MpcdiFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "common/output/BlendPicture.h"
#include "server/tools/mpcdi/ZipFile.h"
#include "server/tools/walls/WallReading.h"
#include "server/tools/walls/XmlText.h"

namespace tessera {
namespace {

constexpr std::pair<std::string_view, MpcdiProfile> kProfiles[] = {
    {"2d", MpcdiProfile::k2d}, {"3d", MpcdiProfile::k3d}, {"a3", MpcdiProfile::kA3}, {"sl", MpcdiProfile::kSl}};
constexpr std::pair<std::string_view, double> kUnits[] = {{"mm", 0.001},  {"cm", 0.01},   {"dm", 0.1},   {"m", 1},
                                                          {"in", 0.0254}, {"ft", 0.3048}, {"yd", 0.9144}};
constexpr std::size_t kMostXml = std::size_t{4} << 20, kMostPfm = std::size_t{256} << 20, kMostRegions = 256;

class MpcdiReading {
public:
    MpcdiReading(std::string path, std::optional<ZipFile> zip) : path_(std::move(path)), zip_(std::move(zip)) {}

    Expected<MpcdiFile> run() {
        std::string name = "mpcdi.xml";
        Expected<Bytes> text = zip_ ? zip_->read(name, kMostXml) : Expected<Bytes>(wholeFile());
        if (zip_ && !text && text.error().code == ErrorCode::kNotFound) {
            name = zip_->firstWith(".xml");
            if (!name.empty()) text = zip_->read(name, kMostXml);
        }
        if (!text) return tl::unexpected(text.error());
        pugi::xml_document document;
        const Expected<pugi::xml_node> top =
            readXml(document, asText(*text), "MPCDI", zip_ ? path_ + ": " + name : path_);
        if (!top) return tl::unexpected(top.error());
        const pugi::xml_node root = *top;
        const std::string profile = attributeOf(root, "profile");
        const auto known =
            std::ranges::find_if(kProfiles, [&](const auto& one) { return sameWord(profile, one.first); });
        if (known == std::end(kProfiles))
            return wrong(fmt::format("profile \"{}\": 2d, 3d, a3 and sl are read", profile.substr(0, 40)));
        file_.profile = known->second;
        for (const pugi::xml_node& buffer : childrenOf(childOf(root, "display"), "buffer")) {
            if (auto read = readBuffer(buffer); !read) return tl::unexpected(read.error());
        }
        if (regions_ == 0) return wrong("no display with a buffer and a region in it");
        if (childOf(root, "extensionSet")) file_.notes.push_back("extensionSet: extensions of writers are left out");
        for (const pugi::xml_node& set : childrenOf(childOf(root, "files"), "fileset")) {
            if (auto read = readFiles(set); !read) return tl::unexpected(read.error());
        }
        for (const MpcdiBuffer& buffer : file_.buffers)
            for (const MpcdiRegion& region : buffer.regions)
                if (region.warp.pixels.empty() && file_.profile != MpcdiProfile::kSl)
                    return wrong(fmt::format("region \"{}\" has no geometryWarpFile", region.id));
        return std::move(file_);
    }

private:
    [[nodiscard]] tl::unexpected<Error> wrong(std::string what) const {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}", path_, what));
    }

    [[nodiscard]] Expected<double> number(std::string_view word, const std::string& what, double least,
                                          double most) const {
        const std::optional<double> value = numberOfWord(word);
        if (!value || *value < least || *value > most)
            return wrong(
                fmt::format("{} is \"{}\": a number from {} to {} is needed", what, word.substr(0, 40), least, most));
        return *value;
    }
    /// Attributes by name; the first that is wrong is said.
    Expected<void> numbers(const pugi::xml_node& node, const std::string& owner,
                           std::initializer_list<std::pair<const char*, double*>> wanted, double least,
                           double most) const {
        for (const auto& [name, to] : wanted) {
            const auto value = number(attributeOf(node, name), fmt::format("{} of {}", name, owner), least, most);
            if (!value) return tl::unexpected(value.error());
            *to = *value;
        }
        return {};
    }

    Expected<void> readBuffer(const pugi::xml_node& node) {
        MpcdiBuffer buffer{.id = attributeOf(node, "id"), .regions = {}};
        double width = 0, height = 0;
        if (!attributeOf(node, "xResolution").empty()) {
            if (auto ok = numbers(node, fmt::format("buffer \"{}\"", buffer.id),
                                  {{"xResolution", &width}, {"yResolution", &height}}, 1, 65536);
                !ok)
                return ok;
        }
        buffer.widthPx = static_cast<int>(width);
        buffer.heightPx = static_cast<int>(height);
        for (const pugi::xml_node& child : childrenOf(node, "region")) {
            MpcdiRegion region{.id = attributeOf(child, "id"), .warpName = {}, .warp = {}, .alpha = {}};
            // It stands in wall files, logs and names of files.
            if (std::ranges::any_of(region.id, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
                return wrong(
                    "the id of a region has characters that no name has (line breaks, tabs, control characters)");
            const std::string owner = fmt::format("region \"{}\"", region.id);
            if (region.id.empty() || !ids_.insert(region.id).second)
                return wrong("a region without an id, or two of one: \"" + region.id + "\"");
            if (++regions_ > kMostRegions)
                return fail(ErrorCode::kLimit, fmt::format("{}: more than {} regions", path_, kMostRegions));
            double w = 0, h = 0;
            if (auto ok = numbers(child, owner, {{"xResolution", &w}, {"yResolution", &h}}, 1, 16384); !ok) return ok;
            if (auto ok = numbers(child, owner, {{"x", &region.x}, {"y", &region.y}}, -1, 2); !ok) return ok;
            if (auto ok = numbers(child, owner, {{"xsize", &region.width}, {"ysize", &region.height}}, 1e-4, 2); !ok)
                return ok;
            region.widthPx = static_cast<int>(w);
            region.heightPx = static_cast<int>(h);
            if (const pugi::xml_node frame = childOf(child, "coordinateFrame")) {
                if (auto ok = readFrame(frame, owner, region); !ok) return ok;
            }
            if (const pugi::xml_node frustum = childOf(child, "frustum")) {
                region.frustum.emplace();
                MpcdiFrustum& f = *region.frustum;
                for (const auto& [name, to] : {std::pair<const char*, double*>{"yaw", &f.yaw},
                                               {"pitch", &f.pitch},
                                               {"roll", &f.roll},
                                               {"leftAngle", &f.left},
                                               {"rightAngle", &f.right},
                                               {"upAngle", &f.up},
                                               {"downAngle", &f.down}}) {
                    const auto value = number(textOf(frustum, name), fmt::format("{} of {}", name, owner), -360, 360);
                    if (!value) return tl::unexpected(value.error());
                    *to = *value;
                }
                if (!(f.left < f.right && f.down < f.up && f.left > -89 && f.right < 89 && f.down > -89 && f.up < 89))
                    return wrong(fmt::format("the frustum of {} is empty, or as wide as half of all around", owner));
            }
            const bool looks = file_.profile == MpcdiProfile::k3d || file_.profile == MpcdiProfile::kSl;
            if (looks && !region.frustum) return wrong(owner + " has no frustum, which profiles 3d and sl need");
            if (file_.profile == MpcdiProfile::kSl && !region.frame)
                return wrong(owner + " has no coordinateFrame: profile sl says there where its projector is");
            buffer.regions.push_back(std::move(region));
        }
        file_.buffers.push_back(std::move(buffer));
        return {};
    }

    /// The profiles without places in space have no use for it.
    Expected<void> readFrame(const pugi::xml_node& node, const std::string& owner, MpcdiRegion& region) {
        if (file_.profile == MpcdiProfile::k2d || file_.profile == MpcdiProfile::k3d) {
            file_.notes.push_back(owner + ": its coordinateFrame is left out; the wall's own is x right, y up");
            return {};
        }
        MpcdiFrame frame;
        for (const auto& [name, to] : {std::pair<const char*, Vec3d*>{"pos", &frame.position},
                                       {"yaw", &frame.yaw},
                                       {"pitch", &frame.pitch},
                                       {"roll", &frame.roll}}) {
            for (int axis = 0; axis < 3; ++axis) {
                const std::string key = fmt::format("{}{}", name, "xyz"[axis]);
                const auto value = number(textOf(node, key), fmt::format("{} of {}", key, owner), -1e6, 1e6);
                if (!value) return tl::unexpected(value.error());
                (*to)[axis] = *value;
            }
        }
        Mat3d axes;
        axes << frame.yaw, frame.pitch, frame.roll;
        if ((axes.transpose() * axes - Mat3d::Identity()).norm() > 1e-3)
            return wrong(
                fmt::format("the axes yaw, pitch and roll of {} are not of length 1 and square to each other", owner));
        region.frame = frame;
        return {};
    }

    /// A picture of numbers that an element names; nothing where it names none.
    Expected<FloatPicture> readMap(const pugi::xml_node& node, const std::string& owner, std::string& name) {
        name = textOf(node, "path");
        const auto bytes =
            zip_ ? zip_->read(name, kMostPfm)
                 : Expected<Bytes>(wrong(fmt::format("\"{}\" lies in no archive: an MPCDI file is a zip", name)));
        if (!bytes) return failWith(owner, bytes.error());
        return readPfm(*bytes, path_ + ": " + name);
    }

    Bytes wholeFile() const {
        std::ifstream file(path_, std::ios::binary);
        std::string text(kMostXml, '\0');
        file.read(text.data(), static_cast<std::streamsize>(text.size()));
        const ByteSpan read = asBytes(text).first(static_cast<std::size_t>(file.gcount()));
        return {read.begin(), read.end()};
    }

    Expected<void> readFiles(const pugi::xml_node& set) {
        const std::string id = attributeOf(set, "region");
        MpcdiRegion* region = nullptr;
        for (MpcdiBuffer& buffer : file_.buffers)
            for (MpcdiRegion& candidate : buffer.regions)
                if (candidate.id == id) region = &candidate;
        if (!region) return wrong(fmt::format("files for region \"{}\", which there is not", id));
        const std::string owner = fmt::format("region \"{}\"", id);
        if (const pugi::xml_node warp = childOf(set, "geometryWarpFile")) {
            const std::string way = textOf(warp, "interpolation");
            if (!way.empty() && !sameWord(way, "linear") && !sameWord(way, "unknown"))
                file_.notes.push_back(fmt::format("{}: interpolation \"{}\" is taken as linear", owner, way));
            region->origin = textOf(warp, "originof3DData");
            if (const std::string unit = textOf(warp, "geometricUnit"); !unit.empty()) {
                const auto known =
                    std::ranges::find_if(kUnits, [&](const auto& one) { return sameWord(unit, one.first); });
                if (known != std::end(kUnits))
                    region->unitMetres = known->second;
                else if (file_.profile == MpcdiProfile::kA3 || file_.profile == MpcdiProfile::kSl)
                    file_.notes.push_back(fmt::format("{}: the unit of its places, \"{}\", is taken as metres", owner,
                                                      unit.substr(0, 40)));
            }
            if (file_.profile != MpcdiProfile::kSl) {
                auto map = readMap(warp, owner, region->warpName);
                if (!map) return tl::unexpected(map.error());
                region->warp = std::move(*map);
            } else if (!textOf(warp, "path").empty()) {
                file_.notes.push_back(
                    owner + ": the surface that its pixels hit is left out: the scene holds a model of the object");
            }
        }
        if (const pugi::xml_node alpha = childOf(set, "alphaMap"); alpha && !textOf(alpha, "path").empty()) {
            auto bytes = zip_ ? zip_->read(textOf(alpha, "path"), OutputLimits().maxBlendBytes)
                              : Expected<Bytes>(wrong("an alpha map lies in no archive: an MPCDI file is a zip"));
            if (!bytes) return failWith(owner, bytes.error());
            const auto picture = decodeBlendPicture(*bytes);
            if (!picture) return failWith(fmt::format("{}: the alpha map of {}", path_, owner), picture.error());
            if (picture->widthPx != region->widthPx || picture->heightPx != region->heightPx)
                file_.notes.push_back(fmt::format("{}: its alpha map of {} x {} pixels is stretched over its {} x {}",
                                                  owner, picture->widthPx, picture->heightPx, region->widthPx,
                                                  region->heightPx));
            region->alpha = std::move(*bytes);
            if (textOf(alpha, "componentDepth") == "3")
                file_.notes.push_back(owner + ": of its coloured alpha map the green channel is taken");
            if (!textOf(alpha, "gammaEmbedded").empty()) {
                const auto gamma = number(textOf(alpha, "gammaEmbedded"), "gammaEmbedded of " + owner, 0.1, 5);
                if (!gamma) return tl::unexpected(gamma.error());
                region->alphaGamma = *gamma;
            }
        }
        if (childOf(set, "betaMap"))
            file_.notes.push_back(owner + ": its beta map is left out; say `black` in the wall where overlaps show");
        if (const pugi::xml_node lens = childOf(set, "distortionMap"); lens && !textOf(lens, "path").empty()) {
            if (file_.profile != MpcdiProfile::kSl) {
                file_.notes.push_back(owner + ": its distortion map is left out");
                return {};
            }
            auto map = readMap(lens, owner, region->warpName);
            if (!map) return tl::unexpected(map.error());
            region->warp = std::move(*map);
        }
        return {};
    }

    std::string path_;
    std::optional<ZipFile> zip_;  ///< none: the file is the XML itself
    MpcdiFile file_;
    std::set<std::string> ids_;
    std::size_t regions_ = 0;
};

}  // namespace

Expected<MpcdiFile> readMpcdi(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string begin(512, '\0');
    file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    begin.resize(static_cast<std::size_t>(file.gcount()));
    const std::string_view first = withoutBlanks(begin);
    if (first.starts_with("<") || first.starts_with("\xEF\xBB\xBF<")) return MpcdiReading(path, std::nullopt).run();
    auto zip = ZipFile::open(path);
    if (!zip) return tl::unexpected(zip.error());
    return MpcdiReading(path, std::move(*zip)).run();
}

}  // namespace tessera
