/// What a scene file saved: any object of the table, taken over as it is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/scenefile/SavedReader.h"
#include "server/import/ImportedFiles.h"
#include "server/import/PlacedNodes.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Not thread-safe.
class SavedObjects {
public:
    SavedObjects(SceneDraft& draft, const ImportedFiles& files, PlacedNodes& nodes)
        : draft_(draft), files_(files), nodes_(nodes) {}

    /// Object by object, each checked.
    Expected<void> place(LoadedFile& file, const Spot& spot);
    /// Of a file that saved nothing: what a newer version wrote in it beside what authors write.
    void keepBeside(const LoadedFile& file);
    /// With the place in its file, where a file saved the object; nothing: none did.
    [[nodiscard]] std::optional<tl::unexpected<Error>> refusal(const Fault& fault) const;

private:
    struct Part {
        const LoadedFile* file;
        std::uint64_t firstId;
        std::vector<SavedPlace> places;
    };
    void keepLater(LaterParts later);

    SceneDraft& draft_;
    const ImportedFiles& files_;
    PlacedNodes& nodes_;
    std::vector<Part> parts_;
};

}  // namespace tessera
