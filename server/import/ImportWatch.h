/// How far an import is, and whether it is still wanted.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "common/base/Guarded.h"

namespace tessera {

/// Shared by who imports and who looks at it or does not want it any more. Any thread, but for `tell`.
class ImportWatch {
public:
    enum class Stage : std::uint8_t {
        kWaiting,      ///< nobody has begun
        kReading,      ///< the child reads the file
        kConverting,   ///< it works out normals, orders, pictures
        kHandingOver,  ///< what it has read comes through the pipe
        kBuilding      ///< it is checked, and becomes a list
    };
    struct Progress {
        Stage stage = Stage::kWaiting;
        double part = -1;  ///< of the stage, 0 to 1; negative: nobody knows
    };

    /// `total` 0: nobody knows how much there is.
    void at(Stage stage, std::uint64_t done = 0, std::uint64_t total = 0);
    [[nodiscard]] Progress progress() const { return progress_.copy(); }
    /// The import ends soon, with this reason; the first one counts.
    void cancel(Error why);
    [[nodiscard]] std::optional<Error> cancelled() const { return why_.copy(); }

    /// Set before the import begins: called at each news, on the thread that imports, some ten times a second at most.
    std::function<void(const Progress&)> tell = {};

private:
    Guarded<Progress> progress_;
    Guarded<std::optional<Error>> why_;
};

/// "reading".
[[nodiscard]] std::string_view wordFor(ImportWatch::Stage stage);
/// "reading, 43 %".
[[nodiscard]] std::string inWords(const ImportWatch::Progress& progress);

}  // namespace tessera
