// STL files that end too early, and STL files that hold more than triangles.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "common/geometry/Primitives.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

constexpr std::size_t kStlHead = 84, kStlTriangle = 50, kStlCountAt = 80;

std::string_view are(std::uint64_t many) {
    return many == 1 ? "is" : "are";
}

/// Words, whatever lines they stand in; a name goes to the end of its line.
class StlWords {
public:
    explicit StlWords(std::string_view text) : text_(text) {}

    bool next(std::string_view& word) {
        for (;; ++at_) {
            if (at_ >= text_.size()) return false;
            line_ += text_[at_] == '\n' ? 1 : 0;
            if (!isBlank(text_[at_])) break;
        }
        const std::size_t begin = at_;
        while (at_ < text_.size() && !isBlank(text_[at_])) ++at_;
        word = text_.substr(begin, at_ - begin);
        return true;
    }
    void skipLine() { at_ = std::min(text_.find_first_of("\r\n", at_), text_.size()); }
    /// Of a solid: to the end of its line, or to its first triangle there.
    void skipName() {
        const std::size_t begin = at_;
        skipLine();
        for (const char* const triangle : {" facet normal ", " FACET NORMAL "})
            if (const std::size_t facet = text_.substr(begin, at_ - begin).find(triangle); facet != text_.npos)
                at_ = begin + facet;
    }
    [[nodiscard]] std::size_t at() const { return at_; }  ///< behind the word
    [[nodiscard]] std::size_t line() const { return line_; }

private:
    static bool isBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0'; }

    std::string_view text_;
    std::size_t at_ = 0, line_ = 1;
};

/// Counts and numbers of four bytes have zeros among them.
bool isText(std::string_view bytes) {
    return bytes.substr(0, 512).find('\0') == std::string_view::npos;
}

/// Whether its first triangles can be some: other files that were called .stl have numbers of any size there.
bool hasTriangles(const Bytes& bytes, std::uint64_t many) {
    for (std::uint64_t t = 0; t < std::min<std::uint64_t>(many, 64); ++t) {
        std::array<float, 12> numbers{};
        std::memcpy(numbers.data(), bytes.data() + kStlHead + t * kStlTriangle, sizeof(numbers));
        if (!std::ranges::all_of(numbers, [](float number) { return std::abs(number) < 1e12F; })) return false;
    }
    return true;
}

Expected<bool> mendBinaryStl(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing) {
    if (bytes.size() < kStlHead)
        return fail(ErrorCode::kBadInput,
                    fmt::format("it ends after {} bytes, within its header of {}", bytes.size(), kStlHead));
    std::uint32_t announced = 0;
    std::memcpy(&announced, bytes.data() + kStlCountAt, sizeof(announced));
    const std::uint64_t left = bytes.size() - kStlHead;
    const std::uint64_t there = left / kStlTriangle;
    // What lies behind those that are announced is anything.
    const std::uint64_t looked = announced > 0 ? std::min<std::uint64_t>(announced, there) : there;
    if (left == std::uint64_t{announced} * kStlTriangle || !hasTriangles(bytes, looked)) return false;
    std::uint64_t shown = std::min<std::uint64_t>(announced, there);
    if (there < announced) {
        const std::string what = fmt::format(
            "its header announces {} triangles, and {} of them {} there: it is cut off", announced, there, are(there));
        if (there == 0) return fail(ErrorCode::kBadInput, what);
        notes.push_back(what);
        if (missing != nullptr) missing->push_back(what);
    } else if (announced == 0 &&
               left % kStlTriangle == 0) {  // as is left by who writes while the number is not yet known
        notes.push_back(
            fmt::format("its header announces no triangles, and {} {} there: they are shown", there, are(there)));
        shown = there;
    } else {
        notes.push_back(fmt::format("{} bytes behind the {} triangles that its header announces are left out",
                                    left - shown * kStlTriangle, announced));
    }
    bytes.resize(kStlHead + shown * kStlTriangle);
    const auto count = static_cast<std::uint32_t>(shown);
    std::memcpy(bytes.data() + kStlCountAt, &count, sizeof(count));
    return true;
}

/// Of an STL in text.
struct StlFacet {
    std::size_t begun = 0;                          ///< where it begins
    std::vector<std::string_view> normal, corners;  ///< a word for each number
    std::vector<float> places;                      ///< of the corners
    std::string fault;
};

/// The three words that follow.
void readNumbers(StlWords& words, std::vector<std::string_view>& numbers, StlFacet& facet) {
    std::string_view word;
    for (int i = 0; i < 3 && words.next(word); ++i) {
        double value = 0;
        if (!isReal(word, value) && facet.fault.empty())
            facet.fault = fmt::format("line {}: '{}' is no number", words.line(), word.substr(0, 40));
        if (&numbers == &facet.corners) facet.places.push_back(static_cast<float>(value));
        numbers.push_back(word);
    }
}

/// The same, but that facets of more than three corners are several. Nothing is missing at its end.
Expected<std::string> cutFacets(std::string_view text) {
    StlWords words(text);
    std::string_view word;
    std::string made;
    std::size_t done = 0;
    bool inSolid = false;
    StlFacet facet;
    while (words.next(word)) {
        if (isStlWord(word, "endsolid") || (isStlWord(word, "solid") && !inSolid)) {
            inSolid = isStlWord(word, "solid");
            inSolid ? words.skipName() : words.skipLine();
        }
        if (isStlWord(word, "facet")) facet = {.begun = words.at() - word.size()};
        if (isStlWord(word, "normal"))
            readNumbers(words, facet.normal, facet);
        else if (isStlWord(word, "vertex"))
            readNumbers(words, facet.corners, facet);
        if (!isStlWord(word, "endfacet") || facet.corners.size() <= 9) continue;
        if (!facet.fault.empty()) return fail(ErrorCode::kBadInput, facet.fault);
        const Expected<std::vector<std::uint32_t>> triangles =
            assembleRuns({.kind = RunKind::kPolygons, .positions = facet.places, .indices = {}, .lengths = {}});
        if (!triangles) return failWith(fmt::format("line {}", words.line()), triangles.error());
        made.append(text.substr(done, facet.begun - done));
        for (std::size_t i = 0; i < triangles->size(); ++i) {
            if (i % 3 == 0) made += fmt::format("facet normal {} outer loop\n", fmt::join(facet.normal, " "));
            made += fmt::format("vertex {}\n",
                                fmt::join(facet.corners.begin() + std::ptrdiff_t{3} * (*triangles)[i],
                                          facet.corners.begin() + std::ptrdiff_t{3} * (*triangles)[i] + 3, " "));
            if (i % 3 == 2) made += "endloop endfacet\n";
        }
        done = words.at();
    }
    return made.append(text.substr(done));
}

}  // namespace

bool isStlWord(std::string_view word, std::string_view small) {
    constexpr char kSmall = 'a' - 'A';
    return std::ranges::equal(word, small, [](char c, char s) { return c == s || c == s - kSmall; });
}

bool isTextStl(std::string_view bytes) {
    if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
    const std::size_t begin = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
    return isStlWord(bytes.substr(begin, 5), "solid") && isText(bytes);
}

namespace {

/// `hasMore`: whether a facet has more than three corners.
Expected<bool> endTextStl(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing,
                          bool& hasMore) {
    const std::string_view text = asText(bytes);
    StlWords words(text);
    std::string_view word;
    std::uint64_t whole = 0, ofSolid = 0;
    std::size_t begun = 0, end = 0;  // of the facet that is open, its line; behind the last whole one
    bool inSolid = false, inFacet = false;
    int corners = 0;
    while (words.next(word)) {
        if (isStlWord(word, "solid") && !inSolid) {
            words.skipName();
            inSolid = true;
            ofSolid = 0;
            end = words.at();
        } else if (isStlWord(word, "endsolid")) {
            words.skipLine();
            inSolid = inFacet = false;
            end = words.at();
        } else if (!inSolid) {  // nobody reads on
            notes.push_back(fmt::format("what is behind 'endsolid' is left out (line {})", words.line()));
            return false;
        } else if (isStlWord(word, "facet")) {
            inFacet = true;
            begun = words.line();
            corners = 0;
        } else if (isStlWord(word, "vertex")) {
            ++corners;
        } else if (isStlWord(word, "endfacet")) {
            hasMore = hasMore || corners > 3;
            inFacet = false;
            ++whole;
            ++ofSolid;
            end = words.at();
        }
    }
    if (!inSolid) return false;
    std::string what =
        inFacet ? fmt::format("it ends within a triangle (line {})", begun) : std::string("it ends without 'endsolid'");
    what += fmt::format(": it is cut off; {} whole {} there", whole, whole == 1 ? "triangle is" : "triangles are");
    if (whole == 0) return fail(ErrorCode::kBadInput, what);
    if (missing != nullptr) missing->push_back(what);
    notes.push_back(std::move(what));
    bytes.resize(end);
    const ByteSpan closed = asBytes("\nendsolid\n");
    bytes.insert(bytes.end(), closed.begin(), closed.end());
    return true;
}

}  // namespace

Expected<bool> mendStl(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing) {
    const std::string_view text = asText(bytes);
    if (!isTextStl(text)) return isText(text) ? Expected<bool>(false) : mendBinaryStl(bytes, notes, missing);
    bool hasMore = false;
    Expected<bool> ended = endTextStl(bytes, notes, missing, hasMore);
    if (!ended || !hasMore) return ended;
    const Expected<std::string> cut = cutFacets(asText(bytes));
    if (!cut) return tl::unexpected(cut.error());
    const ByteSpan made = asBytes(*cut);
    bytes.assign(made.begin(), made.end());
    return true;
}

std::string doubtOfLastLine(std::size_t line) {
    return fmt::format("its last line (line {}) has no line break: its last number may be cut off", line);
}

}  // namespace tessera
