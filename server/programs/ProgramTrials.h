/// Sees to it that no host compiles what nobody has tried: verdicts of all programs of a scene, as edits of the
/// server's own.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/HistoryIds.h"
#include "common/base/TimeSource.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/programs/ProgramTrial.h"

namespace tessera {

/// Where a list says anything of a program, whatever it says of the verdict, that is "untried" with it: in the same
/// list, so that no host has a text with another text's verdict. `scene` is what the list is meant for. What is led
/// back comes back with the verdict that it had.
void resetVerdicts(ChangeList& list, const Aspect& scene);

/// One child at a time; a text that was tried is not tried again, as long as it is among the last kKept. Frame thread
/// only.
class ProgramTrials {
public:
    /// Of the edits that carry verdicts; nobody waits for them.
    static constexpr std::uint64_t kTicket = ~std::uint64_t{1};
    static constexpr std::size_t kKept = 1024;

    /// `program`: as ProgramTrial's. `patience`: as Platform::childPatience.
    explicit ProgramTrials(std::string program = {}, const TimeSource& time = machineTime(), Duration patience = {})
        : program_(std::move(program)), time_(time), patience_(patience) {}

    /// After each list applied to the scene, with that list; null: anything may have changed.
    /// `frame`: that shows it first.
    void update(const Aspect& scene, const ChangeList* list, FrameNumber frame = {});
    /// A host was held up by a program: it becomes heavy, with all others of its texts, if it is good still. `host`:
    /// its name; `milliseconds`: of one picture, when it gave up; `frame`: that it drew, before which nothing may have
    /// been said of the program since: another text is meant then.
    void heldUp(ObjectId program, std::string_view host, double milliseconds, FrameNumber frame);
    /// What is bad or heavy, for a person: a line each, at most kMostTold of them.
    [[nodiscard]] std::vector<std::string> troubles(const Aspect& scene) const;
    static constexpr std::size_t kMostTold = 16;
    /// What has come out since, of programs as they are now. Starts what is next. Waits as long as `patience` for what
    /// is to be tried, where there is something.
    [[nodiscard]] ChangeList verdicts(const Aspect& scene, Duration patience = {});
    /// Of bad ones, for a person, since the last call.
    [[nodiscard]] std::vector<std::string> takeRemarks() { return std::exchange(remarks_, {}); }
    /// Programs to be tried, the one under way counted; none where nothing can be tried.
    [[nodiscard]] std::size_t pending() const { return cannot_ ? 0 : due_.size(); }
    [[nodiscard]] std::uint64_t tried() const { return tried_; }

private:
    using Texts = std::pair<std::string, std::string>;
    void startNext(const Aspect& scene, TimePoint now);

    std::string program_;
    const TimeSource& time_;
    Duration patience_;
    void addHeavy(const Aspect& scene, ChangeListBuilder& builder);
    std::set<ObjectId> due_;
    std::set<ObjectId> all_;                  ///< programs with a text
    std::set<ObjectId> wrong_;                ///< of them, bad or heavy
    std::map<ObjectId, FrameNumber> saidIn_;  ///< of programs: something of them, last
    std::map<ObjectId, std::string> heavy_;   ///< with what is wrong: to be said
    std::map<Texts, TrialVerdict> known_;
    std::deque<Texts> order_;  ///< of `known_`, oldest first
    std::optional<ProgramTrial> running_;
    Texts runs_;
    std::vector<std::string> remarks_;
    std::uint64_t tried_ = 0;
    bool cannot_ = false;  ///< nothing can be tried here
    bool news_ = false;    ///< more is due, or known, than when all that is due was looked at last
};

}  // namespace tessera
