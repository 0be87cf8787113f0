#include "server/tools/mpcdi/MpcdiFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <pugixml.hpp>
#include <set>

#include "common/output/BlendPicture.h"
#include "server/tools/mpcdi/ZipFile.h"

namespace tessera {
namespace {

constexpr std::size_t kMostXml = std::size_t{4} << 20, kMostPfm = std::size_t{256} << 20, kMostRegions = 256;

/// Writers differ in capitals.
bool sameWord(std::string_view a, std::string_view b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](unsigned char x, unsigned char y) {
               return std::tolower(x) == std::tolower(y);
           });
}
pugi::xml_node childOf(const pugi::xml_node& node, std::string_view name) {
    for (const pugi::xml_node& child : node.children())
        if (sameWord(child.name(), name)) return child;
    return {};
}
std::vector<pugi::xml_node> childrenOf(const pugi::xml_node& node, std::string_view name) {
    std::vector<pugi::xml_node> found;
    for (const pugi::xml_node& child : node.children())
        if (sameWord(child.name(), name)) found.push_back(child);
    return found;
}
std::string attributeOf(const pugi::xml_node& node, std::string_view name) {
    for (const pugi::xml_attribute& attribute : node.attributes())
        if (sameWord(attribute.name(), name)) return attribute.value();
    return {};
}
std::string textOf(const pugi::xml_node& node, std::string_view child) {
    std::string_view text = childOf(node, child).child_value();
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
    return std::string(text);
}

class MpcdiReading {
public:
    MpcdiReading(std::string path, ZipFile zip) : path_(std::move(path)), zip_(std::move(zip)) {}

    Expected<MpcdiFile> run() {
        std::string name = "mpcdi.xml";
        auto text = zip_.read(name, kMostXml);
        if (!text && text.error().code == ErrorCode::kNotFound) {
            name = zip_.firstWith(".xml");
            if (!name.empty()) text = zip_.read(name, kMostXml);
        }
        if (!text) return tl::unexpected(text.error());
        pugi::xml_document document;
        const pugi::xml_parse_result parsed = document.load_buffer(text->data(), text->size());
        if (!parsed)
            return wrong(fmt::format("{} is not XML: {} at byte {}", name, parsed.description(), parsed.offset));
        const pugi::xml_node root = childOf(document, "MPCDI");
        if (!root) return wrong(name + " has no element MPCDI");
        const std::string profile = attributeOf(root, "profile");
        if (!sameWord(profile, "2d") && !sameWord(profile, "3d"))
            return wrong(
                fmt::format("profile \"{}\": 2d and 3d are read (a3 and sl say where pixels land in space, which needs "
                            "the surface in the scene)",
                            profile));
        file_.threeD = sameWord(profile, "3d");
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
                if (region.warp.pixels.empty())
                    return wrong(fmt::format("region \"{}\" has no geometryWarpFile", region.id));
        return std::move(file_);
    }

private:
    [[nodiscard]] tl::unexpected<Error> wrong(std::string what) const {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}", path_, what));
    }

    [[nodiscard]] Expected<double> number(std::string_view word, const std::string& what, double least,
                                          double most) const {
        double value = std::nan("");
        if (word.starts_with('+')) word.remove_prefix(1);
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error != std::errc() || end != word.data() + word.size() || !(value >= least && value <= most))
            return wrong(
                fmt::format("{} is \"{}\": a number from {} to {} is needed", what, word.substr(0, 40), least, most));
        return value;
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
            if (childOf(child, "coordinateFrame"))
                file_.notes.push_back(owner + ": its coordinateFrame is left out; the wall's own is x right, y up");
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
            if (file_.threeD && !region.frustum) return wrong(owner + " has no frustum, which profile 3d needs");
            buffer.regions.push_back(std::move(region));
        }
        file_.buffers.push_back(std::move(buffer));
        return {};
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
            region->warpName = textOf(warp, "path");
            const std::string way = textOf(warp, "interpolation");
            if (!way.empty() && !sameWord(way, "linear"))
                file_.notes.push_back(fmt::format("{}: interpolation \"{}\" is taken as linear", owner, way));
            const auto bytes = zip_.read(region->warpName, kMostPfm);
            if (!bytes) return failWith(owner, bytes.error());
            auto picture = readPfm(*bytes, path_ + ": " + region->warpName);
            if (!picture) return tl::unexpected(picture.error());
            region->warp = std::move(*picture);
        }
        if (const pugi::xml_node alpha = childOf(set, "alphaMap")) {
            auto bytes = zip_.read(textOf(alpha, "path"), OutputLimits().maxBlendBytes);
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
        if (childOf(set, "distortionMap")) file_.notes.push_back(owner + ": its distortion map is left out");
        return {};
    }

    std::string path_;
    ZipFile zip_;
    MpcdiFile file_;
    std::set<std::string> ids_;
    std::size_t regions_ = 0;
};

}  // namespace

Expected<MpcdiFile> readMpcdi(const std::string& path) {
    auto zip = ZipFile::open(path);
    if (!zip) return tl::unexpected(zip.error());
    return MpcdiReading(path, std::move(*zip)).run();
}

}  // namespace tessera
