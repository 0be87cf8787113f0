/// A wall to which everything happens at once, drawn from a seed; and the laws that hold all the same.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "tests/support/wall/MoveTally.h"
#include "tests/support/wall/RandomWords.h"
#include "tests/support/wall/SimulatedWall.h"
#include "tests/support/wall/StormDisk.h"

namespace tessera::simulation {

struct StormOptions {
    std::string scene;  ///< path of a file
    std::uint64_t seed = 1;
    /// Four tiles, and the same picture on one under each of three cullers. False: one host that draws nothing.
    bool draws = true;
    /// Nothing is asked for that moves by itself, so that undo of everything leads to the first state.
    bool still = false;
};

/// Each step is drawn from a seed of its own, and from the wall as it is then. The same steps lead to the same wall.
class Storm {
public:
    explicit Storm(StormOptions options);
    ~Storm();

    /// Does it, lets some time go by, and looks at the laws. Empty: all hold. Else the one that is broken.
    [[nodiscard]] std::string step(std::uint64_t seed);
    /// All that it takes longer to look at: the journal, the pictures.
    [[nodiscard]] std::string lookClosely();
    /// Looks at what only an end shows: undo of everything, the journal once more, the recording.
    [[nodiscard]] std::string end();
    /// The last step in words, for a person.
    [[nodiscard]] const std::string& said() const { return said_; }
    /// Counts of all that applications have said until now: answered as they wished, and refused.
    struct Answers {
        std::uint64_t granted = 0, refused = 0;
    };
    [[nodiscard]] Answers answers() const { return answers_; }

    /// Storms go over several scenes: that of a seed.
    [[nodiscard]] static StormOptions optionsOf(std::uint64_t seed, bool draws);
    [[nodiscard]] static std::vector<std::uint64_t> stepsOf(std::uint64_t seed, std::size_t count);
    /// The number of the step that breaks a law, and which.
    struct Broken {
        std::size_t step = 0;
        std::string law;
    };
    /// Told of each step when it is over, before the laws are looked at.
    using OnStep = std::function<void(std::size_t step, const Storm&)>;
    /// Does all steps from a fresh wall. None: all laws hold.
    [[nodiscard]] static std::optional<Broken> run(const StormOptions& options, std::span<const std::uint64_t> steps,
                                                   const OnStep& onStep = {});
    using Runner = std::function<std::optional<Broken>(std::span<const std::uint64_t> steps)>;
    /// Fewer steps that break a law as well, by a runner that does not change.
    [[nodiscard]] static std::vector<std::uint64_t> shortened(std::vector<std::uint64_t> steps, const Runner& runner,
                                                              Duration atMost);

private:
    struct StepUnderWay;
    struct StormDeed;
    [[nodiscard]] static std::span<const StormDeed> deeds();

    // Deeds: what a step may be. They say in words what they did.
    std::string hostDies(StepUnderWay& step);
    std::string hostHangs(StepUnderWay& step);
    std::string hostIsCutOff(StepUnderWay& step);
    std::string hostFlaps(StepUnderWay& step);
    std::string hostFlapsAndHangs(const std::string& name);
    std::string hostHasAFault(StepUnderWay& step);
    std::string applicationComesOrLeaves(StepUnderWay& step);
    std::string clockIsSet(StepUnderWay& step);
    std::string serverIsKilled(StepUnderWay& step);
    std::string journalIsDamaged(StepUnderWay& step);
    std::string somebodyFlies(StepUnderWay& step);
    std::string arraysAreUploaded(StepUnderWay& step);
    std::string undo(StepUnderWay& step);
    std::string redo(StepUnderWay& step);
    std::string tallyMoves(StepUnderWay& step);
    std::string diskIsFull(StepUnderWay& step);
    std::string syncFails(StepUnderWay& step);
    std::string sceneFileChanges(StepUnderWay& step);
    std::string modelFileChanges(StepUnderWay& step);
    std::string fileIsLoaded(StepUnderWay& step);
    std::string handIsThere(StepUnderWay& step);
    std::string clockPlaysOrStands(StepUnderWay& step);
    std::string changesAreProposed(StepUnderWay& step);
    std::string nodeIsMoved(StepUnderWay& step);
    std::string thingIsSetOnAnother(StepUnderWay& step);
    std::string nodeIsCloned(StepUnderWay& step);
    std::string nodeIsRemoved(StepUnderWay& step);
    std::string anythingIsAsked(StepUnderWay& step);
    std::string threadsAreShort(StepUnderWay& step);

    [[nodiscard]] std::string doOne(Random& random);
    [[nodiscard]] std::string findBroken();
    void killServer();
    void goOn();
    [[nodiscard]] SimulatedApplication& first();
    /// The first application is there, and looks at all lists.
    void follow();
    void forgetQuestionsOf(const std::string& application) { tally_->forgetQuestionsOf(application); }
    [[nodiscard]] std::set<ObjectId> untouched() const;
    [[nodiscard]] std::uint64_t hashOfKept() const;
    [[nodiscard]] std::string framesStopped();
    [[nodiscard]] std::string clockFault();
    [[nodiscard]] std::string pictureFault();
    [[nodiscard]] std::string newcomerFault();
    [[nodiscard]] std::string undoFault();
    /// Makes the frames of the first server again.
    [[nodiscard]] std::string replayFault();
    [[nodiscard]] std::string anyHost(Random& random) const;

    StormOptions options_;
    test::TestFolder folder_;
    std::unique_ptr<SimulatedWall> wall_;
    std::string said_;
    std::size_t steps_ = 0;
    Answers answers_;
    std::vector<std::string> guests_;  ///< applications that are there
    std::set<std::string> faulty_;     ///< hosts that were given a fault
    std::map<std::string, InputState> inputs_;
    std::vector<std::string> files_;
    struct Grants {
        Sequence sequence;
        StateHash state;
    };
    std::optional<Grants> seen_;  ///< the newest list that the first application has seen
    std::unique_ptr<MoveTally> tally_;
    ObjectId clock_, hand_;    ///< an Animation, and the Transform that it leads one unit a second
    std::set<ObjectId> kept_;  ///< that nobody touches
    std::uint64_t keptHash_ = 0;
    StateHash begun_;                             ///< of the scene as it was first
    std::optional<std::uint64_t> clockOffSince_;  ///< frames told when the clock's hand was first seen elsewhere
    std::uint64_t framesTold_ = 0;
    TimePoint frameAt_{};  ///< when the last one was told
    std::shared_ptr<StormDisk> disk_;
    bool recorded_ = false;  ///< what the first server did has been compared
    int changes_ = 0;        ///< of the scene's file
};

}  // namespace tessera::simulation
