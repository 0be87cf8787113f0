#include "client/ctl/NewWall.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "client/ctl/NumberText.h"
#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"

namespace tessera {
namespace {

constexpr double kEyeHeightM = 1.7, kMostMetres = 100;
constexpr int kMostMonitors = 1024;

/// Numbers with one of `between` between two of them, and blanks as people like.
std::vector<double> numbersOf(std::string_view text, std::string_view between) {
    std::vector<double> numbers;
    while (true) {
        const std::size_t end = std::min(text.find_first_of(between), text.size());
        std::string_view word = text.substr(0, end);
        while (word.starts_with(' ')) word.remove_prefix(1);
        while (word.ends_with(' ')) word.remove_suffix(1);
        const Expected<double> number = finiteNumber(std::string(word), "");
        if (!number) return {};
        numbers.push_back(*number);
        if (end == text.size()) return numbers;
        text.remove_prefix(end + 1);
    }
}

std::optional<std::string> takeCount(const std::string& word, int& count) {
    const Expected<double> number = finiteNumber(word, "");
    if (!number || *number != std::floor(*number) || *number < 1 || *number > WallLimits().maxGrid)
        return fmt::format("\"{}\" is no whole number from 1 to {}", word, WallLimits().maxGrid);
    count = static_cast<int>(*number);
    return std::nullopt;
}

std::optional<std::string> takeColumns(const std::string& word, WallPlan& plan) {
    return takeCount(word, plan.columns);
}

std::optional<std::string> takeRows(const std::string& word, WallPlan& plan) {
    if (auto wrong = takeCount(word, plan.rows)) return wrong;
    if (plan.columns * plan.rows > kMostMonitors)
        return fmt::format("{} x {} are {} monitors: a wall has at most {}", plan.columns, plan.rows,
                           plan.columns * plan.rows, kMostMonitors);
    return std::nullopt;
}

std::optional<std::string> takePixels(const std::string& word, WallPlan& plan) {
    const std::vector<double> numbers = numbersOf(word, "xX");
    const int most = WallLimits().maxTilePixels;
    const auto good = [&](double number) { return number == std::floor(number) && number >= 1 && number <= most; };
    if (numbers.size() != 2 || !std::ranges::all_of(numbers, good))
        return fmt::format("\"{}\" is not as 1920x1080 is: two whole numbers from 1 to {}", word, most);
    plan.widthPx = static_cast<int>(numbers[0]);
    plan.heightPx = static_cast<int>(numbers[1]);
    return std::nullopt;
}

/// "55", "55 16:9", "1.21x0.68".
std::optional<std::string> takeSize(const std::string& word, WallPlan& plan) {
    const auto isLength = [](double metres) { return metres >= 0.01 && metres <= kMostMetres; };
    if (word.find_first_of("xX") != std::string::npos) {
        const std::vector<double> metres = numbersOf(word, "xX");
        if (metres.size() != 2 || !std::ranges::all_of(metres, isLength))
            return fmt::format("\"{}\" is not as 1.21x0.68 is: width x height in metres, 0.01 to {:g}", word,
                               kMostMetres);
        plan.widthM = metres[0];
        plan.heightM = metres[1];
        return std::nullopt;
    }
    const std::size_t blank = word.find(' ');
    const Expected<double> inches = finiteNumber(word.substr(0, blank), "");
    std::vector<double> aspect{static_cast<double>(plan.widthPx), static_cast<double>(plan.heightPx)};
    if (blank != std::string::npos) aspect = numbersOf(word.substr(blank), ":");
    const bool shaped = aspect.size() == 2 && aspect[0] > 0 && aspect[1] > 0 && aspect[0] / aspect[1] < 100 &&
                        aspect[1] / aspect[0] < 100;
    if (!inches || !shaped || *inches < 1 || *inches > 2000)
        return fmt::format("\"{}\" is neither inches, 1 to 2000, as 55 or 55 16:9, nor metres, as 1.21x0.68", word);
    const double perPart = *inches * 0.0254 / std::hypot(aspect[0], aspect[1]);
    plan.widthM = perPart * aspect[0];
    plan.heightM = perPart * aspect[1];
    return std::nullopt;
}

std::optional<std::string> takeBezel(const std::string& word, WallPlan& plan) {
    const std::vector<double> numbers = numbersOf(word, " ");
    const auto good = [&](double mm) { return mm >= 0 && mm <= 1000; };
    if (numbers.empty() || numbers.size() > 2 || !std::ranges::all_of(numbers, good))
        return fmt::format("\"{}\" is not as 3.5 is, or 3.5 4: millimetres, 0 to 1000, beside and above each other",
                           word);
    plan.bezelXMm = numbers.front();
    plan.bezelYMm = numbers.back();
    return std::nullopt;
}

std::optional<std::string> takeDistance(const std::string& word, WallPlan& plan) {
    const Expected<double> metres = finiteNumber(word, "");
    if (!metres || *metres < 0.1 || *metres > kMostMetres)
        return fmt::format("\"{}\" is no number of metres, 0.1 to {:g}", word, kMostMetres);
    plan.distanceM = *metres;
    return std::nullopt;
}

std::optional<std::string> takeHosts(const std::string& word, WallPlan& plan) {
    for (const char* known : {"monitor", "column", "row", "wall"}) {
        if (word != known) continue;
        plan.hosts = word;
        return std::nullopt;
    }
    return fmt::format("\"{}\" is not monitor, column, row or wall", word);
}

/// Which host draws a monitor.
std::string hostOf(const WallPlan& plan, int column, int row) {
    if (plan.hosts == "wall") return "here";
    if (plan.hosts == "column") return fmt::format("column{}", column);
    if (plan.hosts == "row") return fmt::format("row{}", row);
    return fmt::format("monitor-{}-{}", column, row);
}

double toMicrometres(double metres) {
    return std::round(metres * 1e6) / 1e6 + 0.0;
}

/// Before the questions, and not only when all are answered.
Expected<void> checkPlace(const verb::NewWall& wish) {
    const std::filesystem::path path(wish.file);
    std::error_code unread;
    if (path.extension() != ".wall" || path.stem().empty())
        return fail(ErrorCode::kUsage,
                    fmt::format("new-wall: \"{}\": a wall's file ends with .wall, as in my.wall", wish.file));
    if (std::filesystem::is_directory(path, unread))
        return fail(ErrorCode::kRefused, wish.file + ": there is a folder of that name");
    if (!wish.force && std::filesystem::symlink_status(path, unread).type() != std::filesystem::file_type::not_found)
        return fail(ErrorCode::kRefused,
                    wish.file + ": there is such a file already; name another one, or say --force");
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    if (!std::filesystem::is_directory(folder, unread))
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no folder {}", wish.file, folder.string()));
    return {};
}

/// Never over a file that has come meanwhile, but with --force.
Expected<void> write(const verb::NewWall& wish, const std::string& text) {
    if (wish.force) return writeFile(wish.file, asBytes(text));
    const int made = ::open(wish.file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (made < 0) return fail(ErrorCode::kFailed, wish.file + ": cannot be written");
    const ssize_t written = ::write(made, text.data(), text.size());
    if (::close(made) == 0 && written == static_cast<ssize_t>(text.size())) return {};
    ::unlink(wish.file.c_str());
    return fail(ErrorCode::kFailed, wish.file + ": cannot be written: is the disk full?");
}

}  // namespace

const std::vector<WallMeasure>& wallMeasures() {
    static const std::vector<WallMeasure> measures{
        {"columns", "N", "Monitors beside each other", "How many monitors stand beside each other", nullptr,
         takeColumns},
        {"rows", "N", "Monitors above each other", "How many stand above each other", nullptr, takeRows},
        {"pixels", "WxH", "Of a monitor (1920x1080)", "Pixels of a monitor", "1920x1080", takePixels},
        {"size", "SIZE",
         "Of a monitor's picture without its frame: inches of\nits diagonal (55, or \"55 16:9\"), or width x "
         "height\nin metres (1.21x0.68)",
         "Size of a monitor's picture: inches (55, or 55 16:9) or metres (1.21x0.68)", nullptr, takeSize},
        {"bezel", "MM",
         "Between two pictures, both frames: millimetres, or\nbeside and above each other, \"3.5 4\" (0)",
         "Millimetres between two pictures, both frames together", "0", takeBezel},
        {"distance", "M", "Of the eyes from the wall, metres", "Metres from the wall to the eyes", nullptr,
         takeDistance},
        {"hosts", "EACH", "Who draws: a computer for each monitor, column or\nrow, or one for the wall (monitor)",
         "A computer for each: monitor, column, row, wall", "monitor", takeHosts}};
    return measures;
}

CLI::App* addNewWall(CLI::App& app, verb::NewWall& wish) {
    CLI::App* verb = app.add_subcommand("new-wall", "Writes a wall file of a few measures; needs no server");
    verb->footer("What is not said is asked for, at a terminal. The test picture proves the file.");
    verb->add_option("FILE", wish.file, "FILE.wall to write")->required();
    for (const WallMeasure& measure : wallMeasures())
        verb->add_option(std::string("--") + measure.name, wish.measures[measure.name], measure.help)
            ->type_name(measure.typeName);
    verb->add_flag("--force", wish.force, "Over a file that is there");
    return verb;
}

Expected<WallPlan> planOf(const verb::NewWall& wish, const Ask& ask) {
    WallPlan plan;
    std::vector<std::string> missing;
    // What was said is wrong at once, and not after six questions.
    for (const WallMeasure& measure : wallMeasures()) {
        const auto said = wish.measures.find(measure.name);
        if (said != wish.measures.end() && !said->second.empty()) {
            if (const auto wrong = measure.take(said->second, plan))
                return fail(ErrorCode::kUsage, fmt::format("new-wall: --{}: {}", measure.name, *wrong));
        } else if (measure.otherwise == nullptr) {
            missing.push_back(fmt::format("--{} {}", measure.name, measure.typeName));
        }
    }
    if (missing.empty()) return plan;
    if (!ask)
        return fail(ErrorCode::kUsage,
                    fmt::format("new-wall: there is no terminal to ask at; say {}; see tessera-ctl new-wall --help",
                                fmt::join(missing, ", ")));
    plan = {};
    std::string before;
    for (const WallMeasure& measure : wallMeasures()) {
        const auto said = wish.measures.find(measure.name);
        if (said != wish.measures.end() && !said->second.empty()) {
            if (const auto wrong = measure.take(said->second, plan))  // beside the answers
                return fail(ErrorCode::kUsage, fmt::format("new-wall: --{}: {}", measure.name, *wrong));
            continue;
        }
        for (;;) {
            const std::optional<std::string> line =
                ask(fmt::format("{}{}{}: ", before, measure.question,
                                measure.otherwise ? fmt::format(" [{}]", measure.otherwise) : ""));
            if (!line)
                return fail(ErrorCode::kUsage,
                            fmt::format("new-wall: the answers end before --{}: nothing is written", measure.name));
            std::string word = *line;
            while (!word.empty() && std::isspace(static_cast<unsigned char>(word.back()))) word.pop_back();
            word.erase(0, std::min(word.find_first_not_of(" \t"), word.size()));
            if (word.empty() && measure.otherwise) word = measure.otherwise;
            const std::optional<std::string> wrong =
                word.empty() ? std::optional<std::string>("an answer is needed; Ctrl-C ends this")
                             : measure.take(word, plan);
            if (!wrong) break;
            before = fmt::format("  {}\n", *wrong);
        }
        before.clear();
    }
    return plan;
}

Expected<Wall> wallOfPlan(const WallPlan& plan) {
    const double pixelX = plan.widthM / plan.widthPx, pixelY = plan.heightM / plan.heightPx;
    Screen screen{.name = "wall"};
    Screen::Grid& grid = screen.grid;
    grid.columns = plan.columns;
    grid.rows = plan.rows;
    grid.tileWidthPx = plan.widthPx;
    grid.tileHeightPx = plan.heightPx;
    // Hidden pixels beyond a monitor's own would be a wall of another kind.
    const auto hidden = [](double mm, double pixelM) {
        return static_cast<int>(std::lround(std::min(mm / 1000 / pixelM, 1e5)));
    };
    grid.bezelXPx = plan.columns > 1 ? hidden(plan.bezelXMm, pixelX) : 0;
    grid.bezelYPx = plan.rows > 1 ? hidden(plan.bezelYMm, pixelY) : 0;
    const double width = plan.columns * plan.widthM + (plan.columns - 1) * grid.bezelXPx * pixelX;
    const double height = plan.rows * plan.heightM + (plan.rows - 1) * grid.bezelYPx * pixelY;
    const double right = toMicrometres(width / 2), bottom = toMicrometres(std::max(0.0, kEyeHeightM - height / 2));
    screen.lowerLeft = {-right, bottom, 0};
    screen.lowerRight = {right, bottom, 0};
    screen.upperLeft = {-right, toMicrometres(bottom + height), 0};

    Wall wall;
    wall.screens = {screen};
    User user{.name = "viewer"};
    user.position = {0, kEyeHeightM, plan.distanceM};
    wall.users = {user};
    for (int row = 0; row < plan.rows; ++row) {
        for (int column = 0; column < plan.columns; ++column) {
            const std::string name = hostOf(plan, column, row);
            auto host = std::ranges::find(wall.hosts, name, &WallHost::name);
            if (host == wall.hosts.end()) host = wall.hosts.insert(host, {.name = name, .tiles = {}});
            host->tiles.push_back(
                {.screen = "wall", .column = column, .row = row, .eye = Eye::kCenter, .user = "viewer", .output = {}});
        }
    }
    if (Expected<void> good = checkWall(wall); !good) return tl::unexpected(good.error());
    return wall;
}

Expected<Answer> makeNewWall(const verb::NewWall& wish, const Print& print) {
    if (Expected<void> good = checkPlace(wish); !good) return tl::unexpected(good.error());
    Ask ask;
    if (::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1)
        ask = [&](const std::string& question) -> std::optional<std::string> {
            print(question);
            std::string line;
            if (!std::getline(std::cin, line)) return std::nullopt;
            return line;
        };
    const Expected<WallPlan> plan = planOf(wish, ask);
    if (!plan) return tl::unexpected(plan.error());
    const Expected<Wall> wall = wallOfPlan(*plan);
    if (!wall) return failWith("new-wall", wall.error());
    const Screen& screen = wall->screens.front();
    const ScreenPixels pixels = screenPixels(screen);
    const double pixelX = 1000 * plan->widthM / plan->widthPx, pixelY = 1000 * plan->heightM / plan->heightPx;
    const std::string what =
        fmt::format("{} x {} monitors of {} x {} pixels, {:.4g} x {:.4g} m each; {} x {} pixels are hidden between two",
                    plan->columns, plan->rows, plan->widthPx, plan->heightPx, plan->widthM, plan->heightM,
                    screen.grid.bezelXPx, screen.grid.bezelYPx);
    const std::string comments = fmt::format(
        "# {}.\n# Metres, right-handed, +Y up, -Z into the wall; the origin is on the floor below its middle. Correct "
        "the heights:\n"
        "# the picture's lower edge is at {:.6g} m and the eyes are at {:.6g} m. Column 0 is left, row 0 is at the "
        "bottom.\n"
        "# A host may name its machine: hosts {{ … machine {{ ssh: \"wall@wall-1\" }} }} (wall-file.md).\n",
        what, screen.lowerLeft.y(), kEyeHeightM);
    const Expected<std::string> text = wallText(*wall);
    if (!text) return failWith("new-wall", text.error());
    if (Expected<void> written = write(wish, comments + *text); !written) return tl::unexpected(written.error());
    Answer answer;
    answer.text = fmt::format(
        "{}: {}\nthe whole picture: {:.4g} x {:.4g} m, {} x {} pixels; hosts: {}\nsee it in windows here:\n"
        "  tessera-wall --wall {} --test-picture --window\nor as out/wall.png:\n  tessera-wall --wall {} "
        "--test-picture --frames 2\n",
        wish.file, what, screen.widthMetres(), screen.heightMetres(), pixels.width, pixels.height, wall->hosts.size(),
        wish.file, wish.file);
    answer.json = {{"file", wish.file},
                   {"columns", plan->columns},
                   {"rows", plan->rows},
                   {"hosts", wall->hosts.size()},
                   {"width_m", screen.widthMetres()},
                   {"height_m", screen.heightMetres()},
                   {"width_px", pixels.width},
                   {"height_px", pixels.height},
                   {"bezel_x_px", screen.grid.bezelXPx},
                   {"bezel_y_px", screen.grid.bezelYPx}};
    if (std::max(pixelX / pixelY, pixelY / pixelX) > 1.01)
        answer.warning =
            fmt::format("pixels are {:.4g} mm wide and {:.4g} mm high: is the size that of {} x {} pixels?", pixelX,
                        pixelY, plan->widthPx, plan->heightPx);
    return answer;
}

}  // namespace tessera
