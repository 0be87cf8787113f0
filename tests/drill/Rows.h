/// What the drill does to walls, a function a row.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/drill/Judgement.h"
#include "tests/integration/Process.h"

namespace tessera::drill {

struct DrillOptions {
    std::uint64_t nodes = 100'000;
    bool large = false;  ///< a million nodes for who loads or joins
    int repetitions = 3;
    int seconds = 60;  ///< that a crowd stands around
};

struct Row {
    std::string name;
    std::string deed;  ///< what was done, for the table
    Promise promise;
    std::function<Measurement(const DrillOptions&)> run;
};

[[nodiscard]] std::vector<Row> hostRows();
[[nodiscard]] std::vector<Row> serverRows();
[[nodiscard]] std::vector<Row> strangerRows();
[[nodiscard]] std::vector<Row> crowdRows();
[[nodiscard]] std::vector<Row> linkRows();
[[nodiscard]] std::vector<Row> applicationRows(const DrillOptions& options);

/// At most so many nodes (and no fewer than 400): boxes in a block, half of the nodes Transforms; one of them, "mover",
/// goes round with every frame where `moving`.
[[nodiscard]] std::string drillScene(std::uint64_t nodes, bool moving = true);

}  // namespace tessera::drill
