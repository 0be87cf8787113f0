#include "tests/support/wall/World.h"

#include <algorithm>
#include <utility>

namespace tessera::simulation {

// ---- programs

void World::Program::poke() {
    schedule(world_->now());
}

void World::Program::hang(bool hangs) {
    hangs_ = hangs;
    if (!hangs) poke();
}

void World::Program::schedule(TimePoint when) {
    when = std::max(when, world_->now()) + world_->random_.between({}, slowness_);
    if (when >= due_) return;
    due_ = when;
    world_->timeline_.at(when, [weak = weak_from_this(), when] {
        const std::shared_ptr<Program> program = weak.lock();
        if (!program || program->due_ != when) return;  // an earlier one came in between
        program->due_ = TimePoint::max();
        if (program->hangs_) return;
        program->turn_();
        if (const TimePoint next = program->nextWake_(); next != TimePoint::max()) program->schedule(next);
    });
}

std::shared_ptr<World::Program> World::run(Program::Turn turn, Program::NextWake nextWake) {
    auto program = std::make_shared<Program>();
    program->world_ = this;
    program->turn_ = std::move(turn);
    program->nextWake_ = std::move(nextWake);
    program->schedule(now());
    return program;
}

// ---- lanes

struct World::LaneState {
    std::size_t width = 1;
    std::deque<Lane::Piece> pieces = {};
    bool over = false;

    void runOne(Random& random) {
        if (pieces.empty() || over) return;
        const auto chosen = pieces.begin() + static_cast<std::ptrdiff_t>(random.below(std::min(width, pieces.size())));
        const Lane::Piece piece = std::move(*chosen);
        pieces.erase(chosen);
        piece();
    }
    void end() {
        over = true;
        const std::deque<Lane::Piece> gone = std::exchange(pieces, {});
    }
};

/// Pieces begin some time after they were posted: in their order, of a wide lane nearly so.
class World::SimulatedLane final : public Lane {
public:
    SimulatedLane(World& world, std::shared_ptr<LaneState> state) : world_(world), state_(std::move(state)) {}
    ~SimulatedLane() override { state_->end(); }

    void post(Piece piece) override {
        if (state_->over) return;
        state_->pieces.push_back(std::move(piece));
        world_.timeline_.after(world_.random_.between({}, world_.laneDelay),
                               [state = state_, &random = world_.random_] { state->runOne(random); });
    }
    void postAt(TimePoint due, Piece piece) override {
        if (state_->over) return;
        world_.timeline_.at(due, [state = state_, piece = std::move(piece)] {
            if (!state->over) piece();
        });
    }
    void finish() override {
        while (!state_->pieces.empty()) state_->runOne(world_.random_);
        state_->end();
    }

private:
    World& world_;
    std::shared_ptr<LaneState> state_;
};

void World::kill(const std::string& program) {
    const auto [begin, end] = lanes_.equal_range(program);
    for (auto lane = begin; lane != end; ++lane)
        if (const std::shared_ptr<LaneState> state = lane->second.lock()) state->end();
    lanes_.erase(program);
    network_.reset(program);
}

Platform World::platform(const std::string& program, std::function<void()> poke) {
    return {.time = &time_,
            .random =
                [this] {
                    return Hash128{random_.next(), random_.next()};
                },
            .lane =
                [this, program](const LaneOptions& options) {
                    auto state = std::make_shared<LaneState>();
                    state->width = std::max<std::size_t>(1, options.width);
                    lanes_.emplace(program, state);
                    return std::make_unique<SimulatedLane>(*this, std::move(state));
                },
            .transport = network_.transportOf(program, std::move(poke)),
            .feeds = feeds_.make(),
            .childPatience = 60s};
}

bool World::runUntil(const std::function<bool()>& done, Duration atMost) {
    const TimePoint end = now() + atMost;
    while (!done())
        if (!timeline_.runNext(end)) return false;
    return true;
}

}  // namespace tessera::simulation
