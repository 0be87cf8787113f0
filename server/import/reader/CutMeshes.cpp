// STL, OFF and DXF files that end too early.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

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
    void skipLine() { at_ = std::min(text_.find('\n', at_), text_.size()); }
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

Expected<bool> mendBinaryStl(Bytes& bytes, std::vector<std::string>& notes) {
    if (bytes.size() < kStlHead) return fail(ErrorCode::kBadInput, fmt::format("it ends after {} bytes, within its header of {}", bytes.size(), kStlHead));
    std::uint32_t announced = 0;
    std::memcpy(&announced, bytes.data() + kStlCountAt, sizeof(announced));
    const std::uint64_t left = bytes.size() - kStlHead;
    const std::uint64_t there = left / kStlTriangle;
    if (left == std::uint64_t{announced} * kStlTriangle || !hasTriangles(bytes, there)) return false;
    std::uint64_t shown = std::min<std::uint64_t>(announced, there);
    if (there < announced) {
        const std::string what = fmt::format("its header announces {} triangles, and {} of them {} there: it is cut off", announced, there, are(there));
        if (there == 0) return fail(ErrorCode::kBadInput, what);
        notes.push_back(what);
    } else if (announced == 0 && left % kStlTriangle == 0) {  // as is left by who writes while the number is not yet known
        notes.push_back(fmt::format("its header announces no triangles, and {} {} there: they are shown", there, are(there)));
        shown = there;
    } else {
        notes.push_back(fmt::format("{} bytes behind the {} triangles that its header announces are left out", left - shown * kStlTriangle, announced));
    }
    bytes.resize(kStlHead + shown * kStlTriangle);
    const auto count = static_cast<std::uint32_t>(shown);
    std::memcpy(bytes.data() + kStlCountAt, &count, sizeof(count));
    return true;
}

}  // namespace

bool isTextStl(std::string_view bytes) {
    const std::size_t begin = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
    return bytes.substr(begin).starts_with("solid") && isText(bytes);
}

Expected<bool> mendStl(Bytes& bytes, std::vector<std::string>& notes) {
    const std::string_view text = asText(bytes);
    if (!isTextStl(text)) return isText(text) ? Expected<bool>(false) : mendBinaryStl(bytes, notes);
    StlWords words(text);
    std::string_view word;
    std::uint64_t whole = 0, ofSolid = 0;
    std::size_t begun = 0, end = 0;  // of the facet that is open, its line; behind the last whole one
    bool inSolid = false, inFacet = false;
    while (words.next(word)) {
        if (word == "solid" && !inSolid) {
            words.skipLine();
            inSolid = true;
            ofSolid = 0;
            end = words.at();
        } else if (word == "endsolid") {
            words.skipLine();
            inSolid = inFacet = false;
            end = words.at();
        } else if (!inSolid) {  // nobody reads on
            notes.push_back(fmt::format("what is behind 'endsolid' is left out (line {})", words.line()));
            return false;
        } else if (word == "facet") {
            inFacet = true;
            begun = words.line();
        } else if (word == "endfacet") {
            inFacet = false;
            ++whole;
            ++ofSolid;
            end = words.at();
        }
    }
    if (!inSolid) return false;
    std::string what = inFacet ? fmt::format("it ends within a triangle (line {})", begun) : std::string("it ends without 'endsolid'");
    what += fmt::format(": it is cut off; {} whole {} there", whole, whole == 1 ? "triangle is" : "triangles are");
    if (whole == 0) return fail(ErrorCode::kBadInput, what);
    notes.push_back(std::move(what));
    bytes.resize(end);
    const ByteSpan closed = asBytes("\nendsolid\n");
    bytes.insert(bytes.end(), closed.begin(), closed.end());
    return true;
}

Expected<bool> mendOff(Bytes& bytes, std::vector<std::string>& notes) {
    const std::string_view text = asText(bytes);
    TextLines lines(text);
    std::vector<std::string_view> words;
    const auto next = [&] {
        while (lines.next(words)) {
            const auto remark = std::ranges::find_if(words, [](std::string_view word) { return word.starts_with('#'); });
            words.erase(remark, words.end());
            if (!words.empty()) return true;
        }
        return false;
    };
    std::uint64_t vertices = 0, faces = 0;
    if (!next() || words[0].find("OFF") == std::string_view::npos) return false;
    words.erase(words.begin());
    if (words.empty() && !next()) return false;
    if (words.size() < 2 || !isNumber(words[0], vertices) || !isNumber(words[1], faces)) return false;  // assimp says what it is not
    const std::string_view count = words[1];
    const std::size_t line = lines.line();
    const auto cutOff = [&](std::uint64_t announced, const char* what, std::uint64_t there) {
        return fmt::format("it announces {} {} (line {}), and {} of them {} there: it is cut off", announced, what, line, there, are(there));
    };
    for (std::uint64_t v = 0; v < vertices; ++v)
        if (!next() || words.size() < 3) return fail(ErrorCode::kBadInput, cutOff(vertices, "vertices", v));
    std::uint64_t there = 0;
    std::size_t end = text.size() - lines.bytesLeft();
    for (; there < faces && next(); ++there) {
        std::uint64_t corners = 0;
        const bool whole = isNumber(words[0], corners) && corners < words.size();
        if (!whole && lines.bytesLeft() == 0) break;
        end = text.size() - lines.bytesLeft();
    }
    if (there == faces) {
        if (next()) notes.push_back(fmt::format("what is behind the {} faces that it announces is left out (line {})", faces, lines.line()));
        return false;
    }
    if (there == 0) return fail(ErrorCode::kBadInput, cutOff(faces, "faces", there));
    notes.push_back(cutOff(faces, "faces", there));
    const auto at = static_cast<std::size_t>(count.data() - text.data());
    std::string made(text.substr(0, at));
    made.append(std::to_string(there)).append(text.substr(at + count.size(), end - at - count.size()));
    const ByteSpan whole = asBytes(made);
    bytes.assign(whole.begin(), whole.end());
    return true;
}

void noteCutDxf(std::string_view text, std::vector<std::string>& notes) {
    const std::size_t last = text.find_last_not_of(" \t\r\n");
    const std::string_view end = last == std::string_view::npos ? std::string_view() : text.substr(0, last + 1);
    if (!end.ends_with("EOF")) notes.emplace_back("it ends without 'EOF': it is cut off");
}

}  // namespace tessera
