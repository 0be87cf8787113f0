// OFF files: what assimp 5.2.5 would read otherwise than it is there, without a word.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/geometry/Primitives.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/TextLines.h"

namespace tessera {
namespace {

constexpr std::size_t kMostOffCorners = 9;     ///< that assimp reads of a face
constexpr std::size_t kLongestOffLine = 4000;  ///< that it reads as one
constexpr std::size_t kLongestOffWord = 250;   ///< of the 14 that a vertex may need

/// Goes through a file twice: it looks, then it writes what it found to be good.
class OffMending {
public:
    explicit OffMending(std::string_view text) : text_(text), lines_(text) {}

    /// False: it is no OFF in text; assimp says what it is not.
    bool readHeader() {
        if (!next()) return false;
        std::string_view word = words_[0];
        const auto takes = [&](std::string_view letters) {
            if (!word.starts_with(letters)) return false;
            word.remove_prefix(letters.size());
            return true;
        };
        kind_ = word;
        const bool texcoords = takes("ST");
        hasColors_ = takes("C");
        const bool normals = takes("N");
        isHomogeneous_ = takes("4");
        const bool saysDimensions = takes("n");
        if (word != "OFF" || !dropWord()) return false;
        if (saysDimensions && (!isNumber(words_[0], dimensions_) || dimensions_ < 1 || dimensions_ > 3 || !dropWord()))
            return false;
        if (words_.size() < 2 || !isNumber(words_[0], vertices_) || !isNumber(words_[1], faces_)) return false;
        differs_ = words_.size() < 3;  // it would take the first vertex's first number for that of edges
        countLine_ = lines_.line();
        saysDimensions_ = saysDimensions;
        colorsFrom_ = dimensions_ + (isHomogeneous_ ? 1 : 0) + (normals ? 3 : 0);
        behindColors_ = texcoords ? 2 : 0;
        return true;
    }

    Expected<void> look(std::vector<std::string>& notes, std::vector<std::string>* missing) {
        const TextLines body = lines_;
        if (Expected<void> read = readVertices(nullptr); !read) return read;
        if (Expected<void> read = readFaces(nullptr); !read) return read;
        if (const std::string text = leftOut(); written_ == 0 && !text.empty()) return fail(ErrorCode::kBadInput, text);
        if (there_ == faces_ && next())
            notes.push_back(fmt::format("what is behind the {} faces that it announces is left out (line {})", faces_,
                                        lines_.line()));
        if (there_ < faces_) {
            if (there_ == 0) return fail(ErrorCode::kBadInput, cutOff(faces_, "faces", there_));
            notes.push_back(cutOff(faces_, "faces", there_));
            if (missing != nullptr) missing->push_back(notes.back());
            differs_ = true;
        }
        if (wrong_ > 0) notes.push_back(leftOut());
        if (wrong_ > 0 && missing != nullptr) missing->push_back(leftOut());
        if (longVertices_ > 0)
            notes.push_back(fmt::format("what is behind the {} numbers of {} {} is left out (the first: line {})",
                                        colorsFrom_ + (hasColors_ ? 4 : 0) + behindColors_, longVertices_,
                                        longVertices_ == 1 ? "vertex" : "vertices", firstLongVertex_));
        if (longFaces_ > 0)
            notes.push_back(
                fmt::format("what is behind the corners of {} {} is left out (mostly a colour; the first: line {})",
                            longFaces_, longFaces_ == 1 ? "face" : "faces", firstLongFace_));
        if (doubtfulLine_ > 0) notes.push_back(doubtOfLastLine(doubtfulLine_));
        lines_ = body;
        return {};
    }
    [[nodiscard]] bool differs() const { return differs_; }

    /// After `look`.
    Expected<Bytes> write() {
        std::string out = fmt::format("{}\n{}{} {} 0\n", kind_, saysDimensions_ ? fmt::format("{}\n", dimensions_) : "",
                                      vertices_, written_);
        out.reserve(text_.size());
        if (Expected<void> read = readVertices(&out); !read) return tl::unexpected(read.error());
        if (Expected<void> read = readFaces(&out); !read) return tl::unexpected(read.error());
        const ByteSpan made = asBytes(out);
        return Bytes(made.begin(), made.end());
    }

private:
    /// The words of the next line that has any besides a remark.
    bool next() {
        while (lines_.next(words_)) {
            const auto remark =
                std::ranges::find_if(words_, [](std::string_view word) { return word.starts_with('#'); });
            words_.erase(remark, words_.end());
            if (!words_.empty()) return true;
        }
        return false;
    }
    /// Of what the header says, which may stand in one line or in several.
    bool dropWord() {
        words_.erase(words_.begin());
        return !words_.empty() || next();
    }
    /// The next line, which is to be right behind the one before.
    bool nextItem() {
        const std::size_t before = lines_.line();
        const bool isThere = next();
        if (lines_.line() > before + 1 && before > countLine_) differs_ = true;  // remarks and blanks would be items
        return isThere;
    }
    [[nodiscard]] bool isLast() const {
        return lines_.bytesLeft() == 0 && !text_.ends_with('\n') && !text_.ends_with('\r');
    }
    [[nodiscard]] bool endsText(std::string_view word) const {
        return word.data() + word.size() == text_.data() + text_.size();
    }
    /// Assimp cuts long lines in two.
    void lookAtLength() {
        differs_ = differs_ || static_cast<std::size_t>(words_.back().data() + words_.back().size() -
                                                        words_.front().data()) > kLongestOffLine;
    }

    [[nodiscard]] std::string cutOff(std::uint64_t announced, const char* what, std::uint64_t there) const {
        return fmt::format("it announces {} {} (line {}), and {} of them {} there: it is cut off", announced, what,
                           countLine_, there, there == 1 ? "is" : "are");
    }
    [[nodiscard]] std::string leftOut() const {
        return wrong_ == 0 ? std::string()
                           : fmt::format("{} of {} faces {} left out; the first, {}", wrong_, there_,
                                         wrong_ == 1 ? "is" : "are", firstWrong_);
    }

    Expected<void> readVertices(std::string* out) {
        std::vector<double> numbers;
        for (std::uint64_t v = 0; v < vertices_; ++v) {
            if (!nextItem()) return fail(ErrorCode::kBadInput, cutOff(vertices_, "vertices", v));
            const std::size_t most = colorsFrom_ + (hasColors_ ? 4 : 0) + behindColors_;
            const std::size_t least = most - (hasColors_ ? 1 : 0);  // a colour may say no opacity
            std::string fault;
            if (words_.size() < least) fault = fmt::format("it has {} numbers of {}", words_.size(), least);
            numbers.resize(std::min(words_.size(), most));
            for (std::size_t i = 0; i < numbers.size() && fault.empty(); ++i)
                if (words_[i].size() > kLongestOffWord || !isReal(words_[i], numbers[i]))
                    fault = fmt::format("'{}' is no number", words_[i].substr(0, 40));
            if (!fault.empty() && isLast()) return fail(ErrorCode::kBadInput, cutOff(vertices_, "vertices", v));
            if (!fault.empty())
                return fail(ErrorCode::kBadInput, fmt::format("line {}: this is no vertex: {}", lines_.line(), fault));
            if (out != nullptr) {
                writeVertex(numbers, *out);
                continue;
            }
            if (words_.size() > most && longVertices_++ == 0) firstLongVertex_ = lines_.line();
            lookAtLength();
            differs_ = differs_ || numbers.size() < most;
            for (std::size_t i = colorsFrom_; hasColors_ && i < numbers.size() - behindColors_; ++i)
                colorsOfBytes_ = colorsOfBytes_ || numbers[i] > 1;
        }
        differs_ = differs_ || colorsOfBytes_;
        return {};
    }
    void writeVertex(const std::vector<double>& numbers, std::string& out) {
        const std::size_t colorsEnd = hasColors_ ? numbers.size() - behindColors_ : colorsFrom_;
        const auto copyWords = [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) out.append(words_[i]).push_back(' ');
        };
        copyWords(0, colorsFrom_);
        if (!colorsOfBytes_)
            copyWords(colorsFrom_, colorsEnd);
        else
            for (std::size_t i = colorsFrom_; i < colorsEnd; ++i) out += fmt::format("{} ", numbers[i] / 255);
        if (hasColors_ && colorsEnd < colorsFrom_ + 4) out += "1 ";
        copyWords(colorsEnd, numbers.size());
        out.back() = '\n';
        if (!isCutting_) return;
        const double by = isHomogeneous_ ? numbers[dimensions_] : 1;
        for (std::size_t i = 0; i < 3; ++i)
            places_.push_back(i < dimensions_ ? static_cast<float>(numbers[i] / by) : 0);
    }

    /// What keeps the words from being a face, or empty. `corners_`: its vertices. `isWhole_`: whether the line is not
    /// one that ends too early.
    std::string faceFault() {
        std::uint64_t count = 0, vertex = 0;
        corners_.clear();
        isWhole_ = false;
        if (!isNumber(words_[0], count)) return fmt::format("'{}' is no number of corners", words_[0].substr(0, 40));
        if (count == 0) return "it has no corners";
        if (count > words_.size() - 1) return fmt::format("it says {} corners, and has {}", count, words_.size() - 1);
        for (std::size_t i = 1; i <= count; ++i) {
            isWhole_ = isNumber(words_[i], vertex);
            if (!isWhole_ || vertex >= vertices_)
                return fmt::format("'{}' names none of the {} vertices", words_[i].substr(0, 40), vertices_);
            corners_.push_back(static_cast<std::uint32_t>(vertex));
        }
        return {};
    }
    Expected<void> readFaces(std::string* out) {
        for (std::uint64_t f = 0; f < (out == nullptr ? faces_ : there_); ++f) {
            if (!nextItem()) return {};
            const std::string fault = faceFault();
            if (out != nullptr) {
                if (!fault.empty()) continue;
                if (Expected<void> written = writeFace(*out); !written) return written;
                continue;
            }
            if (isLast() && !isWhole_) return {};
            ++there_;
            lookAtLength();
            if (!fault.empty()) {
                differs_ = true;
                if (wrong_++ == 0) firstWrong_ = fmt::format("line {}: {}", lines_.line(), fault);
                continue;
            }
            if (words_.size() > corners_.size() + 1 && longFaces_++ == 0) firstLongFace_ = lines_.line();
            if (endsText(words_[corners_.size()])) doubtfulLine_ = lines_.line();
            const bool isCut = corners_.size() > kMostOffCorners;
            isCutting_ = isCutting_ || isCut;
            differs_ = differs_ || isCut;
            written_ += isCut ? corners_.size() - 2 : 1;
        }
        return {};
    }
    Expected<void> writeFace(std::string& out) {
        if (corners_.size() <= kMostOffCorners) {
            out += std::to_string(corners_.size());
            for (const std::uint32_t corner : corners_) out.append(1, ' ').append(std::to_string(corner));
            out += '\n';
            return {};
        }
        const Expected<std::vector<std::uint32_t>> triangles =
            assembleRuns({.kind = RunKind::kPolygons, .positions = places_, .indices = corners_, .lengths = {}});
        if (!triangles) return failWith(fmt::format("line {}", lines_.line()), triangles.error());
        for (std::size_t i = 0; i + 3 <= triangles->size(); i += 3)
            out += fmt::format("3 {} {} {}\n", (*triangles)[i], (*triangles)[i + 1], (*triangles)[i + 2]);
        return {};
    }

    std::string_view text_, kind_;
    TextLines lines_;
    std::vector<std::string_view> words_;
    bool hasColors_ = false, isHomogeneous_ = false, saysDimensions_ = false;
    std::uint64_t dimensions_ = 3, vertices_ = 0, faces_ = 0;
    std::size_t colorsFrom_ = 0, behindColors_ = 0;  ///< numbers of a vertex
    std::size_t countLine_ = 0, doubtfulLine_ = 0;
    bool differs_ = false;        ///< assimp would read something else
    bool colorsOfBytes_ = false;  ///< 0 to 255, where assimp wants 0 to 1
    bool isWhole_ = false;        ///< the face that was looked at last
    bool isCutting_ = false;      ///< into triangles, faces of more corners than assimp reads
    std::uint64_t there_ = 0, written_ = 0, wrong_ = 0, longVertices_ = 0, longFaces_ = 0;
    std::size_t firstLongVertex_ = 0, firstLongFace_ = 0;
    std::string firstWrong_;
    std::vector<float> places_;
    std::vector<std::uint32_t> corners_;
};

}  // namespace

Expected<bool> mendOff(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing) {
    OffMending off(asText(bytes));
    if (!off.readHeader()) return false;
    if (Expected<void> looked = off.look(notes, missing); !looked) return tl::unexpected(looked.error());
    if (!off.differs()) return false;
    Expected<Bytes> written = off.write();
    if (!written) return tl::unexpected(written.error());
    bytes = std::move(*written);
    return true;
}

}  // namespace tessera
