/// The drill's table: each row run, judged, printed and kept for the JSON file.
#pragma once

#include <string>
#include <vector>

#include "tests/drill/Rows.h"

namespace tessera::drill {

enum class Verdict : std::uint8_t { kKept, kBroken, kSkipped, kNotAvailable };

class DrillTable {
public:
    static void printHead();
    /// A row whose promise was not kept is run again, once: a shared machine's noise rarely comes twice. The table says
    /// so.
    void run(const Row& row, const DrillOptions& options);
    /// How many rows were in the end not kept.
    [[nodiscard]] int broken() const;
    void printEnd() const;
    /// {"rows":[{"row","deed","missed_p50","missed_max","missed_limit",…,"verdict"}]}
    [[nodiscard]] bool writeJson(const std::string& path) const;

private:
    struct Line {
        Row row;
        Measurement measured;
        Verdict verdict = Verdict::kKept;
        std::vector<std::string> reasons;
        int tries = 1;
    };
    static void print(const Line& line);
    static Line runOnce(const Row& row, const DrillOptions& options);

    std::vector<Line> lines_;
};

}  // namespace tessera::drill
