#include "tests/bench/SceneStage.h"

#include <utility>

#include "common/wall/Wall.h"
#include "tests/bench/SceneSide.h"
#include "tests/bench/SceneTreeOurs.h"

namespace tessera::bench {
namespace {

Wall someWall() {
    Wall wall;
    wall.screens.emplace_back();
    wall.users.emplace_back();
    return wall;
}

}  // namespace

SceneStage::SceneStage(SceneShape shape, std::uint64_t size) : view_(someWall(), "") {
    std::vector<ChangeList> lists;
    lists.push_back(makeScene({.shape = shape, .size = size}));
    const Expected<CommittedFrame> loaded = simulation_.load(std::move(lists));
    must(loaded.has_value());
    must(replica_.apply(*loaded->list).has_value());
    render_.update(replica_, nullptr);
    places_ = findPlaces(scene());
    view_.update(scene(), nullptr);
    (void)simulation_.step(true, {});
    (void)idle();
}

double SceneStage::edit(const EditKind& kind, std::size_t turn, bool second) {
    std::vector<Edit> edits(1);
    edits[0].list = kind.make(places_, scene(), turn, second);
    const double begin = threadSeconds();
    FrameResult frame = simulation_.step(false, std::move(edits));
    if (frame.commit.list) view_.update(scene(), frame.commit.list.get());
    const double taken = threadSeconds() - begin;
    must(frame.outcomes[0].result.has_value() && frame.outcomes[0].result->stopped.empty() && frame.commit.list);
    frames_.push_back(std::move(frame.commit));
    return taken;
}

double SceneStage::follow() {
    const CommittedFrame frame = std::move(frames_.front());
    frames_.pop_front();
    const double begin = threadSeconds();
    must(replica_.apply(*frame.list).has_value());
    render_.update(replica_, frame.list.get());
    const double taken = threadSeconds() - begin;
    must(replica_.stateHash() == frame.sent->stateHash);
    return taken;
}

double SceneStage::idle() {
    const double begin = threadSeconds();
    const FrameResult frame = simulation_.step(false, {});
    must(view_.view(scene()).has_value());
    const double taken = threadSeconds() - begin;
    must(frame.commit.list == nullptr);
    return taken;
}

}  // namespace tessera::bench
