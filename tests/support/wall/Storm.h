/// A wall to which everything happens at once, drawn from a seed; and the laws that hold all the same.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/support/wall/RandomWords.h"
#include "tests/support/wall/SimulatedWall.h"

namespace tessera::simulation {

struct StormOptions {
    std::string scene;  ///< path of a file
    std::uint64_t seed = 1;
    /// Four tiles, and the same picture on one under each of three cullers. False: one host that draws nothing.
    bool draws = true;
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
    /// The last step in words, for a person.
    [[nodiscard]] const std::string& said() const { return said_; }
    /// Counts of all that applications have said until now: answered as they wished, and refused.
    struct Answers {
        std::uint64_t granted = 0, refused = 0;
    };
    [[nodiscard]] Answers answers() const { return answers_; }

    /// Storms go over several scenes: the path of one of them.
    [[nodiscard]] static std::string sceneOf(std::uint64_t seed);
    [[nodiscard]] static std::vector<std::uint64_t> stepsOf(std::uint64_t seed, std::size_t count);
    /// Does all steps from a fresh wall. The number of the step that breaks a law, and which; none: all hold.
    struct Broken {
        std::size_t step = 0;
        std::string law;
    };
    [[nodiscard]] static std::optional<Broken> run(const StormOptions& options, const std::vector<std::uint64_t>& steps,
                                                   std::vector<std::string>* said = nullptr,
                                                   Answers* answers = nullptr);
    /// Fewer steps that break a law as well.
    [[nodiscard]] static std::vector<std::uint64_t> shortened(const StormOptions& options,
                                                              std::vector<std::uint64_t> steps, Duration atMost);

private:
    [[nodiscard]] std::string doOne(Random& random);
    [[nodiscard]] std::string findBroken();
    [[nodiscard]] std::string killAndGoOn(Random& random);
    /// Makes the frames of the first server again.
    [[nodiscard]] std::string replayed();
    /// Finds a node that is moved by relative moves of one unit alone. They are counted: each that is granted is there,
    /// once.
    void beginTally();
    void follow();
    [[nodiscard]] std::string tallyFault();
    /// Its questions will not be answered any more.
    void forgetQuestionsOf(const std::string& application);

    StormOptions options_;
    test::TestFolder folder_;
    std::unique_ptr<SimulatedWall> wall_;
    std::string said_;
    std::size_t steps_ = 0;
    Answers answers_;
    std::vector<std::string> programs_;  ///< of applications that are there
    struct Grants {
        Sequence sequence;
        StateHash state;
    };
    std::optional<Grants> seen_;  ///< the newest list that the first application has seen
    struct Tally {
        ObjectId node, core;
        struct TallyReading {
            Sequence sequence;
            double at = 0;
            bool whole = false;
        };
        std::vector<TallyReading> looks;  ///< of the first application, after each list
        enum class Asked : std::uint8_t { kMove, kStep };
        std::map<std::pair<std::string, std::uint64_t>, Asked> asked;  ///< by application and request
        std::map<Sequence, int> granted;                               ///< moves, by the list that has them
        std::set<Sequence> steps;  ///< lists of undo and redo, which may be of moves
        int unknown = 0;           ///< moves that nobody will be told of
        bool stepUnknown = false;
    } tally_;
    class Disk;
    std::shared_ptr<Disk> disk_;
    bool recorded_ = false;  ///< what the first server did has been compared
    int changes_ = 0;        ///< of the scene's file
};

}  // namespace tessera::simulation
