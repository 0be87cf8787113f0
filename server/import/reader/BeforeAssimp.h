/// Looks at files before assimp 5.2.5 sees them: what it believes without a look makes it read beyond its arrays, or run for ever.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// A PLY's header announces no more than its bytes can hold.
[[nodiscard]] Expected<void> checkPly(std::string_view bytes);
/// An OFF counts no more vertices and faces than its bytes can hold.
[[nodiscard]] Expected<void> checkOff(std::string_view text);
/// The bones of a Half-Life model in text (.smd, .vta) end, and have numbers below that of lines; corners name as many as they announce.
[[nodiscard]] Expected<void> checkSmd(std::string_view text);
/// Counts, indices of vertices, weights and joints of Doom 3's models; into `notes`: vertices that nothing moves.
[[nodiscard]] Expected<void> checkMd5Mesh(std::string_view text, std::vector<std::string>& notes);
/// Key frames of Doom 3's animations have the numbers that their hierarchy asks for.
[[nodiscard]] Expected<void> checkMd5Animation(std::string_view text);
/// Statements of an OBJ that name vertices or texture coordinates that do not exist, or vertices that are not finite, become blanks; into
/// `notes`: how many they are, and the first with its line. So do remarks behind faces, and numbers that begin with a point get a zero before it: assimp
/// knows neither. Whether anything was changed.
bool mendObj(Bytes& bytes, std::vector<std::string>& notes);

/// The checks for each file that assimp opens for one model, by its ending.
class BeforeAssimp {
public:
    /// False: assimp shall not see it, and `refusal` says why.
    [[nodiscard]] bool lets(const std::string& path, Bytes& bytes);
    [[nodiscard]] const std::optional<Error>& refusal() const { return refusal_; }
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

private:
    std::set<std::string> sound_;  ///< opened before, and let through as they were
    std::optional<Error> refusal_;
    std::vector<std::string> notes_;
};

}  // namespace tessera
