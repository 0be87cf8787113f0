#include "server/import/ImportWatch.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {

void ImportWatch::at(Stage stage, std::uint64_t done, std::uint64_t total) {
    Progress now{.stage = stage};
    if (total > 0) now.part = std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
    progress_.with([&](Progress& progress) { progress = now; });
    if (tell) tell(now);
}

void ImportWatch::cancel(Error why) {
    why_.with([&](std::optional<Error>& first) {
        if (!first) first = std::move(why);
    });
}

std::string_view wordFor(ImportWatch::Stage stage) {
    using enum ImportWatch::Stage;
    switch (stage) {
        case kWaiting:
            return "waiting";
        case kReading:
            return "reading";
        case kConverting:
            return "converting";
        case kHandingOver:
            return "handing over";
        case kBuilding:
            return "building";
    }
    return "";
}

std::string inWords(const ImportWatch::Progress& progress) {
    if (progress.part < 0) return std::string(wordFor(progress.stage));
    return fmt::format("{}, {:.0f} %", wordFor(progress.stage), 100 * progress.part);
}

}  // namespace tessera
