#include "server/sim/StartScene.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/sim/commit/Committer.h"
#include "server/sim/desk/Surroundings.h"
#include "server/sim/frame/InlineContents.h"
#include "server/sim/frame/InlineLoading.h"

namespace tessera {

/// Gives the ids that the lists will have once they are loaded, because it is given the same lists.
struct StartScene::Draft {
    Committer committer;
    InlineContents contents;
    InlineLoading loading{Wall()};  // nobody is near anything yet

    [[nodiscard]] bool take(const ChangeList& list) {
        const Expected<Committer::Applied> applied = committer.apply(list);
        if (applied) contents.update(committer.scene(), applied->list.get());
        return applied.has_value();
    }
};

StartScene::StartScene(std::vector<std::string> paths, Placing placing)
    : paths_(std::move(paths)), placing_(std::move(placing)) {}
StartScene::~StartScene() = default;

Expected<void> StartScene::order(Loader& loader, std::uint64_t ticket) const {
    if (paths_.empty()) return {};
    if (!loader.order(
            {.ticket = ticket, .node = kRootNode, .path = paths_[lists_.size()], .placing = placing_, .asked = false}))
        return fail(ErrorCode::kLimit, "too many files wait to be loaded already");
    return {};
}

Expected<std::optional<std::vector<ChangeList>>> StartScene::take(Preparation made, Loader& loader, Log& log) {
    if (made.refused && !made.content) return tl::unexpected(*made.refused);
    for (const std::string& note : made.notes) log.info(note.starts_with(made.path) ? note : made.path + ": " + note);
    if (!made.content) {
        const std::uint64_t ticket = made.ticket;
        add(std::move(made));
        if (lists_.size() < paths_.size()) {
            if (const Expected<void> next = order(loader, ticket); !next) return tl::unexpected(next.error());
            return std::nullopt;
        }
        settleSurroundings(log);
        const auto loads = [](const Creation& creation) {
            return creation.type == typeOf<Inline>() || creation.type == typeOf<ProxyGroup>();
        };
        if (std::ranges::none_of(lists_,
                                 [&](const ChangeList& list) { return std::ranges::any_of(list.creations, loads); }))
            return std::exchange(lists_, {});
        draft_ = std::make_unique<Draft>();
        draft_->committer.skipIds(ObjectId(firstId_));
        // Whoever loads the lists says what is wrong with one.
        for (const ChangeList& list : lists_)
            if (!draft_->take(list)) return std::exchange(lists_, {});
        return goOn(loader, ticket);
    }
    const bool came = !made.refused && draft_->take(made.lists.front());
    const std::string problem = made.refused ? made.refused->message : "the scene has no room for what it holds";
    if (!came) log.warning(fmt::format("{}: {}", made.path, problem));
    draft_->loading.ended(made.content->core, came ? std::nullopt : std::optional(problem));
    const std::uint64_t ticket = made.ticket;
    if (came) add(std::move(made));
    return goOn(loader, ticket);
}

void StartScene::add(Preparation made) {
    const ObjectId first(std::max(firstId_, kRootNode.value + 1) + objects_);
    if (!made.content && bringsSurroundings(made)) {
        Surroundings& brought = surroundings_.emplace_back(Surroundings{made.path, std::move(made.exposures)});
        for (ObjectId& id : brought.exposures) id = ObjectId(first.value + (id.value - kFirstPlaceholder));
    }
    objects_ += made.lists.front().creations.size();
    lists_.push_back(std::move(made.lists.front()));
    if (made.held) made.held->standsFrom(first);
    if (std::optional<FileInScene> file = FileInScene::of(made)) files_.push_back(*std::move(file));
}

void StartScene::settleSurroundings(Log& log) {
    if (surroundings_.size() < 2) return;
    const auto written =
        std::ranges::find_if(surroundings_, [](const Surroundings& one) { return one.exposures.empty(); });
    const auto holds = written == surroundings_.end() ? surroundings_.begin() : written;
    ChangeListBuilder gone;
    for (auto one = surroundings_.begin(); one != surroundings_.end(); ++one) {
        if (one == holds) continue;
        if (one->exposures.empty()) {
            log.info(fmt::format("{}: its Environment does not count: that of {} comes first", one->path, holds->path));
            continue;
        }
        log.info(fmt::format("{}: the Environment of {} says how its lights are exposed", one->path, holds->path));
        if (one > holds) continue;
        gone.detach(one->exposures.front());
        for (const ObjectId id : one->exposures) gone.destroy(id);
    }
    if (!gone.empty()) lists_.push_back(gone.take());
}

std::optional<std::vector<ChangeList>> StartScene::goOn(Loader& loader, std::uint64_t ticket) {
    const Aspect& scene = draft_->committer.scene();
    // One turn looks at some of those that wait.
    for (std::size_t looked = 0; looked <= draft_->contents.pending().size(); looked += InlineLoading::kPerFrame) {
        ChangeList states = draft_->loading.advance(scene, draft_->contents, View());
        std::optional<Preparation> order = draft_->loading.takeOrder();
        if (!states.empty() && draft_->take(states)) lists_.push_back(std::move(states));
        if (!order) continue;
        if (++inlines_ > kMostInlines) break;
        order->ticket = ticket;
        order->asked = false;
        if (loader.order(std::move(*order))) return std::nullopt;
        break;
    }
    draft_.reset();
    return std::exchange(lists_, {});
}

}  // namespace tessera
