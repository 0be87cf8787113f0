// PLY files that hold less than their header announces, or more than is shown.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

/// Named in a note; of more the others are counted.
constexpr std::size_t kMostNamed = 12;

struct PlyProperty {
    std::string name;
    std::size_t lengthBytes = 0;  ///< of a list's length; 0: it is no list
    bool floatLength = false;
    std::size_t bytes = 0;  ///< of the number, or of each of the list's
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0, there = 0;
    std::vector<PlyProperty> properties;
    std::size_t line = 0;             ///< in the header
    std::string_view countInHeader;

    [[nodiscard]] bool isOfFaces() const { return name == "face" || name == "tristrips"; }
};

/// Of a type of a property; 0: there is none of that name.
std::size_t bytesOf(std::string_view type) {
    static const std::map<std::string_view, std::size_t> kBytes = {{"char", 1},  {"uchar", 1},  {"int8", 1},   {"uint8", 1},   {"short", 2},  {"ushort", 2},  {"int16", 2},  {"uint16", 2},
                                                                   {"int", 4},   {"uint", 4},   {"int32", 4},  {"uint32", 4},  {"float", 4},  {"float32", 4}, {"double", 8}, {"float64", 8}};
    const auto known = kBytes.find(type);
    return known == kBytes.end() ? 0 : known->second;
}

enum class PlyEncoding : std::uint8_t { kText, kLittleEndian, kBigEndian };

/// A header, and how much there is of what it announces.
class PlyFile {
public:
    explicit PlyFile(std::string_view bytes) : bytes_(bytes) {}

    Expected<void> readHeader() {
        TextLines lines(bytes_);
        std::vector<std::string_view> words;
        bool ended = false;
        const auto failInLine = [&](const char* why) { return fail(ErrorCode::kBadInput, fmt::format("line {}: {}", lines.line(), why)); };
        while (!ended && lines.next(words)) {
            if (words[0] == "format" && words.size() > 1) encoding_ = words[1] == "ascii" ? PlyEncoding::kText : words[1] == "binary_big_endian" ? PlyEncoding::kBigEndian : PlyEncoding::kLittleEndian;
            if (words[0] == "element") {
                std::uint64_t count = 0;
                if (words.size() != 3 || !isNumber(words[2], count)) return failInLine("an element says its name and how many of it there are");
                elements_.push_back({.name = std::string(words[1].substr(0, 40)), .count = count, .properties = {}, .line = lines.line(), .countInHeader = words[2]});
            }
            if (words[0] == "property" && words.size() > 2 && !elements_.empty()) {
                PlyProperty property{.name = std::string(words.back().substr(0, 40)), .bytes = bytesOf(words[1])};
                if (words[1] == "list" && words.size() > 3) {
                    property.lengthBytes = bytesOf(words[2]);
                    property.floatLength = words[2].starts_with("float") || words[2] == "double";
                    property.bytes = bytesOf(words[3]);
                }
                known_ = known_ && property.bytes > 0 && (words[1] != "list" || property.lengthBytes > 0);
                elements_.back().properties.push_back(std::move(property));
            }
            ended = words[0] == "end_header";
        }
        if (!ended) return fail(ErrorCode::kBadInput, "its header does not end");
        body_ = bytes_.size() - lines.bytesLeft();
        for (const PlyElement& element : elements_)
            if (element.count > 0 && element.properties.empty())
                return fail(ErrorCode::kBadInput, fmt::format("line {}: the element {} has no properties", element.line, element.name));
        return {};
    }
    /// Whether all types are known: of others nobody can tell where the next number begins.
    [[nodiscard]] bool isKnown() const { return known_; }

    /// That it does not announce more than its bytes can hold, whatever unknown types take.
    [[nodiscard]] Expected<void> checkLeast() const {
        std::uint64_t left = bytes_.size() - body_ + 1;  // the last number needs no blank
        for (const PlyElement& element : elements_) {
            std::uint64_t least = 0;
            for (const PlyProperty& property : element.properties) least += encoding_ == PlyEncoding::kText ? 2 : std::max<std::size_t>(property.lengthBytes > 0 ? property.lengthBytes : property.bytes, 1);
            if (element.count > 0 && element.count > left / least)
                return fail(ErrorCode::kBadInput, fmt::format("line {}: it announces {} {}, which take {} bytes each at least, and ends after {}", element.line, element.count, element.name, least,
                                                              bytes_.size() - body_));
            left -= element.count * least;
        }
        return {};
    }

    void count() {
        at_ = body_;
        for (PlyElement& element : elements_) {
            encoding_ == PlyEncoding::kText ? countLines(element) : countRows(element);
            if (element.there < element.count) break;
        }
    }
    [[nodiscard]] const std::vector<PlyElement>& elements() const { return elements_; }
    /// Null: all is there.
    [[nodiscard]] const PlyElement* cut() const {
        const auto found = std::ranges::find_if(elements_, [](const PlyElement& element) { return element.there < element.count; });
        return found == elements_.end() ? nullptr : &*found;
    }
    /// What is there, and a header that announces as much. Whole rows only.
    [[nodiscard]] Bytes whole() const {
        std::string text;
        std::size_t from = 0;
        for (const PlyElement& element : elements_) {
            const auto count = static_cast<std::size_t>(element.countInHeader.data() - bytes_.data());
            text.append(bytes_.substr(from, count - from)).append(std::to_string(element.there));
            from = count + element.countInHeader.size();
        }
        text.append(bytes_.substr(from, at_ - from));
        const ByteSpan made = asBytes(text);
        return Bytes(made.begin(), made.end());
    }

private:
    /// Each element takes a line. That the last one is whole is all that is looked at: others may have more, or fewer, and assimp says so.
    void countLines(PlyElement& element) {
        for (; element.there < element.count; ++element.there) {
            std::size_t begin = at_, end = at_;
            for (;; begin = end + 1) {
                if (begin >= bytes_.size()) return;
                end = std::min(bytes_.find('\n', begin), bytes_.size());
                if (bytes_.substr(begin, end - begin).find_first_not_of(" \t\r") != std::string_view::npos) break;
            }
            if (end == bytes_.size() && !isWhole(bytes_.substr(begin), element)) return;
            at_ = std::min(end + 1, bytes_.size());
        }
    }
    [[nodiscard]] static bool isWhole(std::string_view line, const PlyElement& element) {
        TextLines lines(line);
        std::vector<std::string_view> words;
        if (!lines.next(words)) return false;
        std::size_t word = 0;
        for (const PlyProperty& property : element.properties) {
            std::uint64_t length = 0;
            if (word >= words.size()) return false;
            if (property.lengthBytes > 0 && (!isNumber(words[word], length) || length > words.size())) return false;
            word += 1 + length;
        }
        return word <= words.size();
    }

    void countRows(PlyElement& element) {
        const bool even = std::ranges::all_of(element.properties, [](const PlyProperty& property) { return property.lengthBytes == 0; });
        if (even) {
            std::size_t row = 0;
            for (const PlyProperty& property : element.properties) row += property.bytes;
            element.there = row == 0 ? element.count : std::min<std::uint64_t>(element.count, (bytes_.size() - at_) / row);
            at_ += element.there * row;
            return;
        }
        for (; element.there < element.count; ++element.there) {
            std::size_t at = at_;
            for (const PlyProperty& property : element.properties) {
                std::uint64_t many = 1;
                if (property.lengthBytes > bytes_.size() - at) return;
                if (property.lengthBytes > 0) many = lengthAt(at, property);
                at += property.lengthBytes;
                if (many > (bytes_.size() - at) / property.bytes) return;
                at += many * property.bytes;
            }
            at_ = at;
        }
    }
    [[nodiscard]] std::uint64_t lengthAt(std::size_t at, const PlyProperty& property) const {
        std::array<char, 8> bytes{};
        std::copy_n(bytes_.data() + at, property.lengthBytes, bytes.begin());
        if (encoding_ == PlyEncoding::kBigEndian) std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(property.lengthBytes));
        if (!property.floatLength) {
            std::uint64_t length = 0;
            std::memcpy(&length, bytes.data(), sizeof(length));
            return length;
        }
        double length = 0;
        if (float shorter = 0; property.lengthBytes == sizeof(shorter)) {
            std::memcpy(&shorter, bytes.data(), sizeof(shorter));
            length = shorter;
        } else {
            std::memcpy(&length, bytes.data(), sizeof(length));
        }
        return length >= 0 && length < 1e15 ? static_cast<std::uint64_t>(length) : ~std::uint64_t{0};
    }

    std::string_view bytes_;
    std::vector<PlyElement> elements_;
    PlyEncoding encoding_ = PlyEncoding::kText;
    bool known_ = true;
    std::size_t body_ = 0, at_ = 0;
};

/// What assimp 5.2.5 makes something of.
bool isShown(const std::string& element, const std::string& property) {
    static const std::map<std::string, std::set<std::string>> kShown = {
        {"vertex", {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha", "r", "g", "b", "u", "v", "s", "t", "tx", "ty", "texture_u", "texture_v"}},
        {"face", {"vertex_index", "vertex_indices", "texcoord"}},
        {"tristrips", {"vertex_index", "vertex_indices"}},
        {"material", {"ambient_red", "ambient_green", "ambient_blue", "ambient_alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha", "specular_red", "specular_green",
                      "specular_blue", "specular_alpha", "opacity", "specular_power"}}};
    const auto known = kShown.find(element);
    return known != kShown.end() && known->second.contains(property);
}

std::string someOf(const std::vector<std::string>& names) {
    const std::size_t named = std::min(names.size(), kMostNamed);
    const std::string some = fmt::format("{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(named), ", "));
    return names.size() > named ? fmt::format("{} and {} more", some, names.size() - named) : some;
}

void noteFurther(const std::vector<PlyElement>& elements, std::vector<std::string>& notes) {
    std::vector<std::string> wholly;
    for (const PlyElement& element : elements) {
        std::vector<std::string> further;
        for (const PlyProperty& property : element.properties)
            if (!isShown(element.name, property.name)) further.push_back(property.name);
        if (element.count == 0 || further.empty()) continue;
        if (further.size() == element.properties.size()) wholly.push_back(fmt::format("{} {} ({})", element.count, element.name, someOf(further)));
        else notes.push_back(fmt::format("{} of each {} {} left out", someOf(further), element.name, further.size() == 1 ? "is" : "are"));
    }
    if (!wholly.empty()) notes.push_back(fmt::format("further elements are left out: {}", someOf(wholly)));
}

}  // namespace

Expected<bool> mendPly(Bytes& bytes, std::vector<std::string>& notes) {
    PlyFile file(asText(bytes));
    if (Expected<void> head = file.readHeader(); !head) return tl::unexpected(head.error());
    noteFurther(file.elements(), notes);
    if (!file.isKnown()) {
        if (Expected<void> holds = file.checkLeast(); !holds) return tl::unexpected(holds.error());
        return false;
    }
    file.count();
    const PlyElement* const cut = file.cut();
    if (cut == nullptr) return false;
    const auto announced = [&](const PlyElement& element) { return element.isOfFaces() && element.count > 0; };
    const auto faces = std::ranges::find_if(file.elements(), announced);
    const bool isCloud = faces == file.elements().end();
    std::string what = fmt::format("its header announces {} {} (line {}), and {} of them {} there: it is cut off", cut->count, cut->name, cut->line, cut->there, cut->there == 1 ? "is" : "are");
    // Without all vertices, or any faces, there is no mesh; of a cloud each point is good.
    const bool isLost = isCloud ? cut->name == "vertex" && cut->there == 0 : !(faces->there > 0 && (cut->isOfFaces() || cut > &*faces));
    const bool beforeVertices = std::ranges::none_of(file.elements(), [](const PlyElement& element) { return element.name == "vertex" && element.there > 0; });
    if (isLost || beforeVertices) return fail(ErrorCode::kBadInput, what);
    notes.push_back(std::move(what));
    Bytes whole = file.whole();
    bytes = std::move(whole);
    return true;
}

}  // namespace tessera
