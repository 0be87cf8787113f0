#include "server/tools/walls/ScreenGrids.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

namespace tessera {
namespace {

/// How far places may be from where a grid has them: a fiftieth of a pixel.
double panelTolerance(const DisplayPanel& panel) {
    return std::min(panel.right.norm() / panel.widthPx, panel.up.norm() / panel.heightPx) / 50;
}

bool isUsablePanel(const DisplayPanel& panel) {
    const bool finite = panel.lowerLeft.allFinite() && panel.right.allFinite() && panel.up.allFinite();
    return finite && panel.widthPx > 0 && panel.heightPx > 0 && panel.right.norm() > 1e-6 && panel.up.norm() > 1e-6;
}

bool ofOneKind(const DisplayPanel& a, const DisplayPanel& b) {
    const double near = panelTolerance(a);
    const Vec3d normal = a.right.cross(a.up).normalized();
    return a.user == b.user && a.widthPx == b.widthPx && a.heightPx == b.heightPx &&
           (a.right - b.right).norm() <= near && (a.up - b.up).norm() <= near &&
           std::abs((b.lowerLeft - a.lowerLeft).dot(normal)) <= near;
}

/// Places along one direction, as a row of tiles with something between them.
struct GridSteps {
    std::vector<double> places;  ///< each once, ascending
    double gapPx = 0;
    [[nodiscard]] int indexOf(double place) const {
        const auto nearer = [&](double a, double b) { return std::abs(a - place) < std::abs(b - place); };
        return static_cast<int>(std::ranges::min_element(places, nearer) - places.begin());
    }
};

/// Nothing where the distances differ.
std::optional<GridSteps> stepsOf(std::vector<double> places, double length, int lengthPx, double near) {
    std::ranges::sort(places);
    GridSteps steps;
    for (const double place : places)
        if (steps.places.empty() || place - steps.places.back() > near) steps.places.push_back(place);
    const std::size_t count = steps.places.size();
    if (count == 1) return steps;
    const double pitch = (steps.places.back() - steps.places.front()) / static_cast<double>(count - 1);
    for (std::size_t i = 0; i < count; ++i)
        if (std::abs(steps.places[i] - steps.places.front() - static_cast<double>(i) * pitch) > near)
            return std::nullopt;
    steps.gapPx = (pitch - length) / length * lengthPx;
    return steps;
}

/// The grid of panels of one kind, or why they make none.
struct JoinedPanels {
    std::optional<DisplayGrid> grid;
    std::string why;
};
JoinedPanels joinOfOneKind(const std::vector<DisplayPanel>& panels, const std::vector<std::size_t>& members) {
    const DisplayPanel& first = panels[members.front()];
    const double near = panelTolerance(first);
    const Vec3d across = first.right.normalized(), upwards = first.up.normalized();
    std::vector<double> xs, ys;
    for (const std::size_t index : members) {
        xs.push_back((panels[index].lowerLeft - first.lowerLeft).dot(across));
        ys.push_back((panels[index].lowerLeft - first.lowerLeft).dot(upwards));
    }
    const std::optional<GridSteps> columns = stepsOf(xs, first.right.norm(), first.widthPx, near);
    const std::optional<GridSteps> rows = stepsOf(ys, first.up.norm(), first.heightPx, near);
    if (!columns || !rows || columns->places.size() * rows->places.size() != members.size()) return {};
    if (columns->gapPx > first.widthPx || rows->gapPx > first.heightPx) return {};
    for (const double gap : {columns->gapPx, rows->gapPx})
        if (std::abs(gap - std::round(gap)) > 0.02)
            return {{}, fmt::format("there are {:.3f} pixels between them, and a grid has whole ones", gap)};

    DisplayGrid made;
    std::set<std::pair<int, int>> taken;
    const DisplayPanel *lowerRight = nullptr, *upperLeft = nullptr, *lowerLeft = nullptr;
    const int lastColumn = static_cast<int>(columns->places.size()) - 1;
    const int lastRow = static_cast<int>(rows->places.size()) - 1;
    for (std::size_t i = 0; i < members.size(); ++i) {
        const DisplayGrid::Cell cell{members[i], columns->indexOf(xs[i]), rows->indexOf(ys[i])};
        if (!taken.emplace(cell.column, cell.row).second) return {};
        const DisplayPanel& panel = panels[members[i]];
        if (cell.column == 0 && cell.row == 0) lowerLeft = &panel;
        if (cell.column == lastColumn && cell.row == 0) lowerRight = &panel;
        if (cell.column == 0 && cell.row == lastRow) upperLeft = &panel;
        made.cells.push_back(cell);
    }
    Screen& screen = made.screen;
    screen.lowerLeft = lowerLeft->lowerLeft;
    screen.lowerRight = lowerRight->lowerLeft + lowerRight->right;
    screen.upperLeft = upperLeft->lowerLeft + upperLeft->up;
    screen.grid = {.columns = lastColumn + 1,
                   .rows = lastRow + 1,
                   .tileWidthPx = first.widthPx,
                   .tileHeightPx = first.heightPx,
                   .columnWidthsPx = {},
                   .rowHeightsPx = {}};
    const int gapX = static_cast<int>(std::lround(columns->gapPx)), gapY = static_cast<int>(std::lround(rows->gapPx));
    screen.grid.bezelXPx = std::max(gapX, 0);
    screen.grid.bezelYPx = std::max(gapY, 0);
    screen.grid.overlapXPx = std::max(-gapX, 0);
    screen.grid.overlapYPx = std::max(-gapY, 0);
    const WallLimits limits;
    const ScreenPixels all = screenPixels(screen);
    const bool fits = all.width <= limits.maxScreenPixels && all.height <= limits.maxScreenPixels &&
                      2 * screen.grid.overlapXPx <= first.widthPx && 2 * screen.grid.overlapYPx <= first.heightPx &&
                      screen.grid.columns <= limits.maxGrid && screen.grid.rows <= limits.maxGrid;
    if (!fits) return {};
    return {std::move(made), {}};
}

DisplayGrid panelAlone(const std::vector<DisplayPanel>& panels, std::size_t index, std::string why) {
    const DisplayPanel& panel = panels[index];
    DisplayGrid made{.screen = {}, .cells = {{.panel = index}}, .why = std::move(why)};
    made.screen.lowerLeft = panel.lowerLeft;
    made.screen.lowerRight = panel.lowerLeft + panel.right;
    made.screen.upperLeft = panel.lowerLeft + panel.up;
    made.screen.grid.tileWidthPx = panel.widthPx;
    made.screen.grid.tileHeightPx = panel.heightPx;
    return made;
}

}  // namespace

bool samePlace(const DisplayPanel& a, const DisplayPanel& b) {
    return isUsablePanel(a) && isUsablePanel(b) && ofOneKind(a, b) &&
           (a.lowerLeft - b.lowerLeft).norm() <= panelTolerance(a);
}

std::vector<DisplayGrid> joinPanels(const std::vector<DisplayPanel>& panels) {
    std::vector<DisplayGrid> all;
    std::vector<bool> done(panels.size(), false);
    for (std::size_t i = 0; i < panels.size(); ++i) {
        if (done[i]) continue;
        std::vector<std::size_t> members{i};
        for (std::size_t j = i + 1; j < panels.size() && isUsablePanel(panels[i]); ++j)
            if (!done[j] && isUsablePanel(panels[j]) && ofOneKind(panels[i], panels[j])) members.push_back(j);
        JoinedPanels joined;
        if (members.size() > 1) joined = joinOfOneKind(panels, members);
        for (const std::size_t member : members) {
            done[member] = true;
            if (!joined.grid) all.push_back(panelAlone(panels, member, joined.why));
        }
        if (joined.grid) all.push_back(std::move(*joined.grid));
    }
    return all;
}

}  // namespace tessera
