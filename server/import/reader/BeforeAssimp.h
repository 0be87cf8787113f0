/// Looks at files before assimp 5.2.5 sees them: what it believes without a look makes it read beyond its arrays, or
/// run for ever.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "server/import/reader/ObjMaterials.h"

namespace tessera {

class PlyFile;

// Files that end too early: as far as they go in whole triangles, faces or points, with a note of how many there are of
// how many. Whether anything was changed; refused where nothing can be shown. Into `missing`: of the notes those of
// triangles, faces or points that are not there.

/// A PLY gets a header that announces what is there; strips become triangles, and several elements of faces one. Rows
/// of faces that are none are left out. Refused are vertices that are none, or that nothing places. Into `notes`
/// besides: properties, elements and what is behind them that are not shown.
[[nodiscard]] Expected<bool> mendPly(Bytes& bytes, std::vector<std::string>& notes,
                                     std::vector<std::string>* missing = nullptr);
/// What its header says that cannot be shown, in `notes`; refused where vertices have no place, or types are not known.
[[nodiscard]] Expected<void> notePlyHeader(const PlyFile& file, std::vector<std::string>& notes);
/// An STL ends with a whole triangle; facets of more corners are cut into some. A binary one has the size that its
/// count says; where that is 0, the count that its size says.
[[nodiscard]] Expected<bool> mendStl(Bytes& bytes, std::vector<std::string>& notes,
                                     std::vector<std::string>* missing = nullptr);
/// Headers of binary ones begin with "solid" too.
/// Whether a word of an STL is this one, which is in small letters: some write all in capitals.
[[nodiscard]] bool isStlWord(std::string_view word, std::string_view small);
[[nodiscard]] bool isTextStl(std::string_view bytes);
/// An OFF counts the faces that are there, each in a line, and of as many corners as assimp reads; those that are none
/// are left out. Refused are vertices that are none. Into `notes` besides: what is behind vertices and corners.
[[nodiscard]] Expected<bool> mendOff(Bytes& bytes, std::vector<std::string>& notes,
                                     std::vector<std::string>* missing = nullptr);
/// The note of a text that ends within a line: 17346 cut to 1734 is a number, too.
[[nodiscard]] std::string doubtOfLastLine(std::size_t line);

/// The bones of a Half-Life model in text (.smd, .vta) end, and have numbers below that of lines; corners name as many
/// as they announce. Into `notes`: another section without an end.
[[nodiscard]] Expected<void> checkSmd(std::string_view text, std::vector<std::string>& notes);
/// Counts, indices of vertices, weights and joints of Doom 3's models; into `notes`: vertices that nothing moves.
[[nodiscard]] Expected<void> checkMd5Mesh(std::string_view text, std::vector<std::string>& notes);
/// Key frames of Doom 3's animations have the numbers that their hierarchy asks for.
[[nodiscard]] Expected<void> checkMd5Animation(std::string_view text);
/// Statements of an OBJ that name vertices or texture coordinates that do not exist, or vertices that are not finite,
/// become blanks; into `notes`: how many they are, and the first with its line. So do remarks behind faces, and numbers
/// that begin with a point get a zero before it: assimp knows neither. Free-form statements, of which assimp takes some
/// for others, become blanks, as noteOfFreeform says. Whether anything was changed.
bool mendObj(Bytes& bytes, std::vector<std::string>& notes, std::vector<std::string>* missing = nullptr);
/// Whether statements with this keyword are of free-form curves and surfaces.
[[nodiscard]] bool isOfFreeform(std::string_view key);
/// The first line of an OBJ whose `v` is not followed by three numbers, and why; empty: there is none.
[[nodiscard]] std::string doubtOfVertices(std::string_view text);
/// Which free-form statements of an OBJ nobody reads: curves by themselves, what only joins, marks or approximates,
/// those of version 2.11, and curves of trims that no surface takes. Each by name, with how many and the first's line.
/// Empty: all are read.
[[nodiscard]] std::string noteOfFreeform(std::string_view text);

/// The checks for each file that assimp opens for one model, by its ending.
class BeforeAssimp {
public:
    /// False: assimp shall not see it, and `refusal` says why.
    [[nodiscard]] bool lets(const std::string& path, Bytes& bytes);
    [[nodiscard]] const std::optional<Error>& refusal() const { return refusal_; }
    /// What may be the cause where assimp reads nothing; empty: nothing is known.
    [[nodiscard]] const std::string& doubt() const { return doubt_; }
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
    [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }  ///< of the notes
    /// Of the OBJ that was let through.
    [[nodiscard]] const ObjNames& objNames() const { return objNames_; }

private:
    std::set<std::string> sound_;  ///< opened before, and let through as they were
    std::optional<Error> refusal_;
    std::string doubt_;
    std::vector<std::string> notes_, missing_;
    ObjNames objNames_;
};

}  // namespace tessera
