/// A PLY file as its header announces it, how much of that is there, and the same written as assimp 5.2.5 reads it
/// right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

struct PlyType {
    std::size_t bytes = 0;  ///< 0: nobody knows that type
    bool isFloat = false, isSigned = true;
};

struct PlyProperty {
    std::string name;
    bool isList = false;
    PlyType length;           ///< of a list
    PlyType number;           ///< or of each of a list's
    std::string unknownType;  ///< empty: all are known
    std::size_t line = 0;     ///< in the header
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0, there = 0;  ///< announced, and found
    std::uint64_t leftOut = 0;           ///< of those that are there: they are none
    std::string firstLeftOut;            ///< its line, and why
    std::uint64_t lacking = 0;           ///< vertices that have a place, and not all the rest
    std::string firstLacking;
    std::uint64_t longer = 0,
                  firstLonger = 0;  ///< rows of a text that go on behind all that is asked for; the line of the first
    std::vector<PlyProperty> properties;
    std::size_t line = 0;  ///< in the header
    std::size_t headBegin = 0, countBegin = 0, countEnd = 0;
    std::size_t begin = 0, end = 0;                         ///< its rows
    std::vector<std::pair<std::size_t, std::size_t>> gaps;  ///< among them: rows left out, blank lines

    [[nodiscard]] bool isOfVertices() const { return name == "vertex"; }
    [[nodiscard]] bool isOfFaces() const { return name == "face" || name == "tristrips"; }
    [[nodiscard]] bool isStrips() const { return name == "tristrips"; }
};

/// Keeps a view of the bytes. First readHeader, then, unless a type is not known, count; the rest says what they found.
class PlyFile {
public:
    explicit PlyFile(std::string_view bytes) : bytes_(bytes) {}

    [[nodiscard]] Expected<void> readHeader();
    /// Of a text each row is looked at: what is no vertex is refused by its line, faces that are none are left out.
    [[nodiscard]] Expected<void> count();

    [[nodiscard]] const std::vector<PlyElement>& elements() const { return elements_; }
    /// The first element that is not all there. Null: all is there.
    [[nodiscard]] const PlyElement* cut() const;
    /// The line of a text's last row, if that may go on: there is no line break behind it. 0: it does not.
    [[nodiscard]] std::size_t doubtfulLine() const { return doubtfulLine_; }
    /// What is there behind all that is announced, for a note; empty: nothing.
    [[nodiscard]] std::string behind() const;
    /// Whether faces have to be written as one element: of strips assimp takes the last triangle, and of several
    /// elements it counts the first.
    [[nodiscard]] bool joinsFaces() const;
    [[nodiscard]] bool isText() const { return encoding_ == Encoding::kText; }
    [[nodiscard]] bool isBigEndian() const { return encoding_ == Encoding::kBigEndian; }
    [[nodiscard]] std::size_t bodyBegin() const { return body_; }  ///< of the first row
    /// Strips of which no triangle is left, for a note; empty: there are none.
    [[nodiscard]] std::string emptyStrips() const;
    /// Whether there are faces, and no triangle in any.
    [[nodiscard]] bool hasNoFaces() const { return joinsFaces() && faces_.count == 0; }
    /// Whether it has to be written anew: cut, with gaps, or with faces to be joined.
    [[nodiscard]] bool toBeWritten() const;
    /// Whole rows, without gaps, strips as triangles, and a header that announces as much.
    [[nodiscard]] Bytes written() const;

private:
    enum class Encoding : std::uint8_t { kText, kLittleEndian, kBigEndian };
    struct Faces {
        std::uint64_t count = 0, strips = 0, emptyStrips = 0, firstEmpty = 0;
        std::string rows;
    };

    [[nodiscard]] Expected<void> countLines(PlyElement& element);
    [[nodiscard]] Expected<void> countRows(PlyElement& element);
    [[nodiscard]] double numberAt(std::size_t at, const PlyType& type) const;
    [[nodiscard]] std::uint64_t lengthAt(std::size_t at, const PlyType& type) const;
    void appendRows(const PlyElement& element, std::string& out) const;
    [[nodiscard]] Faces joinedFaces() const;
    /// The numbers of one row's list `property`; from where on the next row is.
    [[nodiscard]] std::size_t readList(const PlyElement& element, std::size_t property, std::size_t at,
                                       std::vector<double>& numbers) const;
    void appendFace(const std::vector<std::int32_t>& corners, Faces& faces) const;

    std::string_view bytes_;
    std::vector<PlyElement> elements_;
    Faces faces_;  ///< where they are joined
    Encoding encoding_ = Encoding::kText;
    std::size_t headEnd_ = 0;  ///< where "end_header" is
    std::size_t body_ = 0, at_ = 0, line_ = 0, doubtfulLine_ = 0;
};

}  // namespace tessera
