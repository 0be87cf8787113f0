/// The wall assistant: a wall file of a few measures, from options or asked for at a terminal. It needs no server.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/wall/Wall.h"

namespace CLI {
class App;
}

namespace tessera {

/// A flat wall of equal monitors, in columns and rows.
struct WallPlan {
    int columns = 0, rows = 0;
    int widthPx = 1920, heightPx = 1080;  ///< of a monitor
    double widthM = 0, heightM = 0;       ///< of a monitor's picture
    double bezelXMm = 0, bezelYMm = 0;    ///< between two pictures
    double distanceM = 0;                 ///< of the eyes from the pictures
    std::string hosts = "monitor";        ///< one for each: "monitor", "column", "row", "wall"
};

/// What is asked for, in the order of the questions. `take` puts an answer, which is never empty, into the plan, or
/// says what is wrong with it.
struct WallMeasure {
    const char *name, *typeName, *help, *question;
    const char* otherwise;  ///< what an empty answer means; null: an answer is needed
    std::optional<std::string> (*take)(const std::string& word, WallPlan& plan);
};
[[nodiscard]] const std::vector<WallMeasure>& wallMeasures();

/// The verb's options, into `wish`.
[[nodiscard]] CLI::App* addNewWall(CLI::App& app, verb::NewWall& wish);

/// Puts a question and returns the line that is answered; nothing: no more will come.
using Ask = std::function<std::optional<std::string>(const std::string& question)>;
/// What the options say, and what `ask` brings for the rest; a wrong answer is asked for again, with the reason.
/// Without `ask` kUsage names what is missing.
[[nodiscard]] Expected<WallPlan> planOf(const verb::NewWall& wish, const Ask& ask);

/// Its lower edge on the floor or above it, its middle at the eyes' height where that is possible. What is hidden
/// between two pictures is whole pixels. kBadInput: more than a wall may have.
[[nodiscard]] Expected<Wall> wallOfPlan(const WallPlan& plan);

/// Asks where standard input is a terminal. kRefused: there is such a file, and no --force.
[[nodiscard]] Expected<Answer> makeNewWall(const verb::NewWall& wish, const Print& print);

}  // namespace tessera
