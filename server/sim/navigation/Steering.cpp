#include "server/sim/navigation/Steering.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

std::string nameOfApplication(std::uint64_t application) {
    // No host is called so: names have no blanks.
    return fmt::format("application {}", application);
}

}  // namespace

Steering::Steering(const Surroundings& around)
    : around_(around),
      lookout_(around.simulation, around.beside),
      navigator_(around.wall),
      setByHand_(around.view.setByHand()) {
    for (const WallHost& host : around.wall.hosts) tiles_[host.name] = tilesOf(around.wall, host.name);
    if (around.drags) hands_.emplace(around.simulation, *around.drags);
}

void Steering::received(const std::string& host, const std::vector<InputState>& states, TimePoint at) {
    if (!around_.takesInput) return;
    // What hands on handles do is not for the view.
    for (const InputState& state : states)
        sources_.take(host, hands_ ? hands_->take(host, state, aimOf(host, state.source)) : state, at);
}

void Steering::hostLeft(const std::string& host) {
    sources_.end(host);
    if (hands_) hands_->end(host);
}

Expected<void> Steering::asked(std::uint64_t application, const NavigationWish& wish, TimePoint at, const Box* fit) {
    using Deed = NavigationWish::Deed;
    if (!around_.takesInput)
        return fail(ErrorCode::kRefused, "this server takes no input (--no-input): the view moves by `view` alone");
    const Aspect& scene = around_.simulation.scene();
    const Expected<View> now = around_.view.view(scene);
    if (!now) return tl::unexpected(now.error());
    if (wish.deed == Deed::kFit && wish.node && !scene.get<Node>(wish.node))
        return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", wish.node.value));
    const std::size_t bookmark = wish.bookmark - 1;
    Expected<View> goal = *now;
    if (wish.deed == Deed::kGoToBookmark) goal = around_.view.bookmark(scene, bookmark);
    if (!goal) return tl::unexpected(goal.error());
    wanted_ = true;
    if (wish.mode) navigator_.setMode(*wish.mode);
    switch (wish.deed) {
        case Deed::kNone:
            break;
        case Deed::kHome:
            navigator_.goHome();
            break;
        case Deed::kFit: {
            const Box box = fit ? *fit : boundsOf(scene, wish.node);
            if (box.empty() || !box.lower.allFinite() || !box.upper.allFinite())
                return fail(ErrorCode::kNotFound, "there is nothing to be seen there that has a size");
            navigator_.fit(box);
            break;
        }
        case Deed::kGoToBookmark:
            navigator_.goTo(*goal);
            break;
        case Deed::kKeepBookmark:
            around_.view.keepBookmark(bookmark, *now);
            break;
    }
    if (wish.input) {
        InputState state = *wish.input;
        state.source = 0;
        // It has one source, whose sums begin at 0: its first word counts, too.
        const std::string name = nameOfApplication(application);
        if (!sources_.knows(name)) {
            sources_.take(name, {}, at);
            if (hands_) (void)hands_->take(name, {}, aimOfApplication());
        }
        sources_.take(name, hands_ ? hands_->take(name, state, aimOfApplication()) : state, at);
    }
    return {};
}

void Steering::applicationLeft(std::uint64_t application) {
    sources_.end(nameOfApplication(application));
    if (hands_) hands_->end(nameOfApplication(application));
}

void Steering::wands(const std::vector<WandState>& wands) {
    if (hands_ && around_.takesInput) hands_->take(wands);
}

void Steering::add(const NavigationInput& input, const std::string& who) {
    if (!around_.takesInput) return;
    addedBy_.insert(who);
    if (!added_) added_.emplace();
    added_->add(input);
}

std::vector<std::string> Steering::active() const {
    std::vector<std::string> names = sources_.active();
    for (const auto& [who, at] : addedAt_)
        if (frameAt_ && *frameAt_ - at < InputSources::kActiveFor) names.push_back(who);
    return names;
}

/// The cursor of a window on its tile, of an application on the first screen, as the tile's user sees it.
std::optional<InputSources::Place> Steering::placeOf(const View& view, const std::string& who, std::uint32_t source,
                                                     double x, double y) const {
    const auto host = tiles_.find(who);
    if (host != tiles_.end() && source >= host->second.size()) return std::nullopt;
    const std::optional<TilePlace> place =
        host == tiles_.end() ? onFirstScreen(x, y) : TilePlace{.tile = &host->second[source], .x = x, .y = y};
    if (!place) return std::nullopt;
    const Tile& tile = *place->tile;
    const Screen* screen = around_.wall.findScreen(tile.screen);
    const User* user = view.findUser(tile.user);
    if (!screen || !user) return std::nullopt;
    const ScreenPixels whole = screenPixels(*screen);
    const Vec3d right = screen->lowerRight - screen->lowerLeft, up = screen->upperLeft - screen->lowerLeft;
    const Vec3d at = screen->lowerLeft + (tile.rect.x + place->x * tile.rect.width) / whole.width * right +
                     (tile.rect.y + (1 - place->y) * tile.rect.height) / whole.height * up;
    const Vec3d eye = user->eye(Eye::kCenter), towards = at - eye;
    const double away = std::abs(right.cross(up).normalized().dot(towards));
    if (!(away > 1e-3)) return std::nullopt;
    return InputSources::Place{.ray = {.origin = eye, .direction = towards.normalized()},
                               .height = up.norm() * tile.rect.height / whole.height / away};
}

std::optional<Ray> Steering::rayThrough(Tile tile, double x, double y) const {
    // A window of both eyes: from between them.
    if (tile.output.stereo != StereoPacking::kNone) tile.eye = Eye::kCenter;
    const Expected<View> view = around_.view.view(around_.simulation.scene());
    const Screen* screen = around_.wall.findScreen(tile.screen);
    if (!view || !screen) return std::nullopt;
    const ScreenPixels whole = screenPixels(*screen);
    const double u = (tile.rect.x + x * tile.rect.width) / whole.width,
                 v = (tile.rect.y + (1 - y) * tile.rect.height) / whole.height;
    const Vec3d at =
        screen->lowerLeft + u * (screen->lowerRight - screen->lowerLeft) + v * (screen->upperLeft - screen->lowerLeft);
    // The eye that the tile is drawn for.
    const Vec3d eye = tileCamera(around_.wall, tile, *view).eyeWorld;
    return Ray{.origin = eye, .direction = (view->world_T_wall() * at - eye).normalized()};
}

HandleInput::Aim Steering::aimOf(const std::string& host, std::uint32_t source) const {
    const auto known = tiles_.find(host);
    if (known == tiles_.end() || source >= known->second.size())
        return {.rayAt = [](double, double) { return std::nullopt; }};
    const Tile& tile = known->second[source];
    return {.rayAt = [this, &tile](double x, double y) { return rayThrough(tile, x, y); },
            .heightPerWidth = static_cast<double>(tile.rect.height) / tile.rect.width};
}

std::optional<Steering::TilePlace> Steering::onFirstScreen(double x, double y) const {
    if (around_.wall.screens.empty()) return std::nullopt;
    const ScreenPixels mosaic = mosaicPixels(around_.wall.screens.front());
    // From below, as tiles lie; the nearest tile's picture goes on beyond its edges.
    const double column = x * mosaic.width, row = (1 - y) * mosaic.height;
    const Tile* nearest = nullptr;
    double least = 0;
    for (const auto& [host, tiles] : tiles_)
        for (const Tile& tile : tiles) {
            const PixelRect& r = tile.mosaicRect;
            if (tile.screen != around_.wall.screens.front().name) continue;
            const double away = std::hypot(std::max({r.x - column, 0.0, column - r.x - r.width}),
                                           std::max({r.y - row, 0.0, row - r.y - r.height}));
            if (nearest && away >= least) continue;
            nearest = &tile;
            least = away;
        }
    if (!nearest) return std::nullopt;
    const PixelRect& r = nearest->mosaicRect;
    return TilePlace{.tile = nearest, .x = (column - r.x) / r.width, .y = 1 - (row - r.y) / r.height};
}

HandleInput::Aim Steering::aimOfApplication() const {
    const auto rayAt = [this](double x, double y) -> std::optional<Ray> {
        const std::optional<TilePlace> place = onFirstScreen(x, y);
        return place ? rayThrough(*place->tile, place->x, place->y) : std::nullopt;
    };
    if (around_.wall.screens.empty()) return {.rayAt = rayAt};
    const ScreenPixels mosaic = mosaicPixels(around_.wall.screens.front());
    return {.rayAt = rayAt, .heightPerWidth = static_cast<double>(mosaic.height) / mosaic.width};
}

NavigationScene Steering::scene() {
    const Simulation& simulation = around_.simulation;
    ViewSource& source = around_.view;
    NavigationScene asked;
    asked.facesIn = [this](const Box& box, std::vector<Triangle>& faces) { return lookout_.facesIn(box, faces); };
    asked.hit = [this](const Ray& ray) { return lookout_.hit(ray); };
    asked.bounds = [this] { return lookout_.bounds(kRootNode); };
    asked.boundsAt = [this](const Ray& ray) { return lookout_.boundsAt(ray); };
    asked.home = [&simulation, &source]() -> std::optional<View> {
        const Expected<View> home = source.home(simulation.scene());
        return home ? std::optional(*home) : std::nullopt;
    };
    asked.homeKnown = [&source] { return source.homeKnown(); };
    asked.bookmark = [&simulation, &source](std::size_t number) -> std::optional<View> {
        const Expected<View> view = source.bookmark(simulation.scene(), number);
        return view ? std::optional(*view) : std::nullopt;
    };
    asked.keepBookmark = [&source](std::size_t number, const View& view) { source.keepBookmark(number, view); };
    return asked;
}

void Steering::frame(TimePoint now) {
    lookout_.frame();
    const Duration passed = frameAt_ ? std::clamp<Duration>(now - *frameAt_, Duration{0}, kLongestFrame) : Duration{0};
    const bool first = !std::exchange(frameAt_, now);
    if (!around_.takesInput) return;
    for (const std::string& who : std::exchange(addedBy_, {})) addedAt_[who] = now;
    // Who has set the view by hand since the last frame has this one.
    const bool placed = std::exchange(setByHand_, around_.view.setByHand()) != around_.view.setByHand();
    if (placed) navigator_.placed();
    if (sources_.empty() && navigator_.idle() && !added_) return;
    const Expected<View> view = around_.view.view(around_.simulation.scene());
    if (!view) return;
    NavigationInput input = sources_.frame(now, [&](const std::string& who, std::uint32_t source, double x, double y) {
        return placeOf(*view, who, source, x, y);
    });
    if (added_) input.add(*std::exchange(added_, {}));
    if (placed || (navigator_.idle() && !input.steers() && input.actions.empty())) return;
    wanted_ = wanted_ || input.steers() || !input.actions.empty();
    const double seconds = wanted_ && !first ? std::chrono::duration<double>(passed).count() : kSecondsPerFrame;
    const Navigator::Step step = navigator_.step(*view, input, scene(), seconds);
    if (step.view) around_.view.steer(*step.view);
    if (step.home) around_.view.letGo();
}

}  // namespace tessera
