/// One frame of the authority: motions and edits in, collision response, one committed list out.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/TimeSource.h"
#include "common/base/Workers.h"
#include "server/collision/pipeline/CollisionPipeline.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/commit/EditHistory.h"
#include "server/sim/commit/ServersNodes.h"
#include "server/sim/frame/ActorTable.h"
#include "server/sim/frame/Actors.h"
#include "server/sim/frame/Frame.h"
#include "server/text/Typesetter.h"

namespace tessera {

struct SimulationOptions {
    SceneLimits scene;
    unsigned threads = 1;  ///< of the collision pipeline; results do not depend on them
    CollisionLimits collision;
    const TimeSource* time = &machineTime();  ///< for what is reported alone
};

/// Deterministic: the same edits and replies in the same frames give the same scenes, contacts and events. Time,
/// threads and the number of clients change nothing of that. Not thread-safe.
///
/// **Order.** Motions write first, then animations, then edits in the order of their arrival. Edits of the table
/// (Actors.cpp) come before those of people. The last writer of a field wins.
/// - An edit that moves something by so much begins where the edits before it lead. So the ways of a frame add up. They
///   are stopped together.
/// - An edit may write a Transform that a motion drives, or a field that an animation drives. Then the motion or
///   animation pauses, until somebody sets it again: `playing` becomes 0 in the same list.
/// - Wishes of motions, animations and edits for existing Transforms go through the collision pipeline. Everything else
///   is committed as it is.
/// - An application's reply to a question about a stopped motion stands above both, in that frame.
/// - Free bodies go where gravity and impulses send them. A body that a motion or an edit moves is moved like anything
///   else, for as long as that lasts.
///
/// **Steps of undo.** A step is the remainder of an edit once collisions have stopped it. An edit that changes nothing
/// is no step, and redo stays possible. It changes nothing if it was stopped at the start, or says what is so already.
/// Edits of one gesture are one step, whatever others edit in between (EditHistory::edited says when not). A gesture
/// that ends where it began is no step.
///
/// **Undo and redo** are no motions: they put things where these were. A thing is in the way only if it touches them
/// there now and did not then. The step is then refused whole, with that thing's name, and stays. So where nothing else
/// has acted the same states come again, overlaps too. A thing that comes back with its nodes is there, as a loaded
/// thing is.
///
/// **Large edits** come in parts, at most one in a frame, hidden until all is there. Then they are seen within as many
/// frames as it takes (LoadParts.h). Undo hides them as they appeared, and takes them away in later frames. Redo brings
/// them again as they came.
/// - Edits that name a thing on its way are refused in words, except the server's own that follow seen things.
/// - While it appears, no step is taken back or done again.
/// - Where a part is refused, the parts before it are taken away again. Their objects that have gone by themselves are
///   left out.
///
/// **Content of Inlines** goes in the frame in which a person's edit, an undo or a redo says so. Lists that are no
/// steps take it away (InlineContents.h). A step that names content gone so is refused and forgotten.
class Simulation {
public:
    explicit Simulation(const SimulationOptions& options = {});

    /// These act too from here on, and must outlive this object. Their wishes come in edits.
    void actWith(OutsideActors& outside) { actors_ = ActorTable(actorsOf(*step_, &outside)); }
    [[nodiscard]] const ActorTable& actors() const { return actors_; }

    /// Makes these lists the scene before the first frame; not undoable. A refused list is named by its
    /// position.
    [[nodiscard]] Expected<CommittedFrame> load(std::vector<ChangeList> lists);

    /// Goes on from the state that another Simulation has left. This one must have nothing yet. Contacts, sleepers and
    /// questions are found anew, so all that touches begins to touch. Parts of an edit that had not all come are taken
    /// away in the first frames.
    struct Left {
        Aspect scene;
        Sequence sequence;
        EditHistory history;
        std::vector<ObjectId> display;  ///< ContactDisplay::ids
    };
    void goOnFrom(Left left);

    /// New objects have ids from `nextId` on, and the next list follows `behind`. Others have seen the numbers before.
    void skipNumbers(std::uint64_t nextId, Sequence behind);

    /// Nobody asks about the last step's lists any more (CollisionPipeline::forgetLists).
    void forgetLists() { pipeline_.forgetLists(); }
    /// Motions and free bodies stand still in the first frame and advance by 1/60 s in each later one.
    [[nodiscard]] FrameResult step(bool firstFrame, std::vector<Edit> edits, std::span<const Reply> replies = {});

    [[nodiscard]] const Aspect& scene() const { return committer_.scene(); }
    [[nodiscard]] Sequence sequence() const { return committer_.sequence(); }
    /// Of the scene, the root included. Kept, not counted.
    [[nodiscard]] std::size_t nodeCount() const { return committer_.nodeCount(); }
    [[nodiscard]] const Motions& motions() const { return step_->motions; }
    [[nodiscard]] const Animations& animations() const { return step_->animations; }
    [[nodiscard]] const SkinPoses& skinPoses() const { return step_->skins; }
    [[nodiscard]] const InlineContents& inlines() const { return step_->inlines; }
    [[nodiscard]] ManipulatorDisplay& manipulators() { return step_->handles; }
    /// The one visible node that has this core; none: none has it, or several have.
    [[nodiscard]] ObjectId bearerOf(ObjectId core) const { return pipeline_.bearerOf(core); }
    /// Motions and animations that play and write what the list writes.
    [[nodiscard]] std::vector<ObjectId> drivingWhat(const ChangeList& list) const;
    [[nodiscard]] const EditHistory& history() const { return history_; }
    [[nodiscard]] const ContactDisplay& display() const { return step_->contacts; }
    /// The list that an undo or redo would apply; of a step in parts the first. Null for other kinds, and where there
    /// is none.
    [[nodiscard]] ChangeListPtr listOf(Edit::Kind kind);
    /// The arrays that an undo or a redo would name; of other kinds none.
    [[nodiscard]] std::vector<Blob> arraysOf(Edit::Kind kind) const;
    /// A step is being taken back or done again over several frames: another one, and parts, would be refused.
    [[nodiscard]] bool stepUnderWay() const { return history_.underWay(); }
    /// Some of what comes in parts is seen, and not yet all: a step would be refused.
    [[nodiscard]] bool appearing() const { return arriving_ && arriving_->seen; }
    /// Questions that the collision pipeline has asked and nobody has replied to, ascending.
    [[nodiscard]] std::vector<std::uint64_t> openQuestions() const { return pipeline_.openQuestions(); }
    /// The nearest visible triangle on a world-space ray.
    [[nodiscard]] std::optional<PickHit> pick(const Ray& ray, PickPatience* patience = nullptr);
    /// What takes longer, to be answered on another thread, and what that has made there (ScenePicker).
    [[nodiscard]] std::optional<AsidePick> pickAside(const Ray& ray);
    [[nodiscard]] std::optional<AsideNearest> nearestAside(const Vec3d& place, ObjectId below);
    void putShapes(std::vector<MadeShape> made);
    /// What is kept for picks no more, for whoever has the time to let go of it.
    [[nodiscard]] std::vector<std::shared_ptr<const CollisionShape>> takeReleased() { return pipeline_.takeReleased(); }
    /// The visible triangles near a place, in world coordinates (ScenePicker::facesIn).
    [[nodiscard]] bool facesIn(const Box& box, QueryWork& work, std::vector<Triangle>& faces,
                               PickPatience* patience = nullptr) {
        return pipeline_.facesIn(scene(), box, work, faces, patience);
    }
    /// The visible surface nearest to a place in world coordinates, at or below a node (ScenePicker::nearest).
    [[nodiscard]] std::optional<NearestSurface> nearestSurface(const Vec3d& place, ObjectId below,
                                                               PickPatience* patience = nullptr);

private:
    /// An edit that may be taken back, until collisions have said what remains of it.
    struct OpenStep {
        std::size_t edit = 0;         ///< its index
        ChangeList inverse;           ///< of all but the Transforms that it wants to move
        std::vector<ObjectId> moves;  ///< those, ascending
        Gesture gesture;
        Overlaps overlaps = {};  ///< of what it moves, in the scene before it
    };

    [[nodiscard]] EditOutcome applyEdit(Edit edit, std::size_t index, Wishes& wishes);
    [[nodiscard]] EditOutcome applyStep(const Edit& edit, Wishes& wishes);
    [[nodiscard]] tl::unexpected<Error> standsThere(Edit::Kind kind, const Overlaps::value_type& pair,
                                                    std::span<const ObjectId> moved) const;
    [[nodiscard]] EditOutcome applyPart(Edit edit);
    [[nodiscard]] Expected<void> beginParts(const Edit& edit);
    /// Has the actors look at a list once its columns are found to be of their fields.
    [[nodiscard]] Expected<void> receive(ChangeList& list, const Actor::Incoming& incoming) const;
    /// Makes each edit so far a step of the history, by the remainder that collisions have left. An edit of which
    /// nothing has remained is no step. A Transform that several edits of a frame move belongs to the last one. If
    /// their ways add up and it got all the way, each edit has its own way.
    void closeSteps(const Wishes& wishes);
    [[nodiscard]] bool mayJoin(const Gesture& gesture, const ChangeList& inverse,
                               std::span<const CollisionPipeline::PosedTransforms> later, Overlaps& overlaps);
    void addOverlapsAmong(std::vector<OpenStep>& steps, std::span<const CollisionPipeline::PosedTransforms> back);
    /// The list that leads back from an edit, from where its Transforms stand now.
    [[nodiscard]] ChangeList closed(OpenStep step, const Wishes& wishes) const;
    /// From where to where an edit has moved a Transform; nothing: it has not.
    struct Way {
        Pose from, to;
    };
    [[nodiscard]] std::optional<Way> wayOf(const OpenStep& step, ObjectId transform, const Wishes& wishes) const;
    /// The list of an edit that moves something by so much, or to a place, with the edits before it.
    [[nodiscard]] Expected<ChangeList> listOf(ObjectId node, const NodeMove& move, const Wishes& wishes) const;
    /// Where a Transform stands for the next edit of the frame. Wishes of earlier *edits* count. A motion's wish is
    /// overruled as a whole, because the motion is paused.
    [[nodiscard]] static Pose poseFor(const Wishes& wishes, ObjectId id, const Transform& now);
    /// Applies the next list of the step under way. Returns the outcome of an undo once nobody sees any of it, and of a
    /// redo once it is whole again.
    [[nodiscard]] std::optional<EditOutcome> goOn();
    /// Whether the next list of an undo under way hides more.
    [[nodiscard]] bool hidesMore() const;
    /// A step that speaks of what is not there is none any more.
    void forgetStep(Edit::Kind kind, const std::string& why, EditOutcome& outcome);
    /// Refuses where a step is under way.
    [[nodiscard]] Expected<void> checkStill() const;
    /// Refuses a step where one is under way, or something appears.
    [[nodiscard]] Expected<void> checkStep() const;
    /// Refuses what names anything that is on its way.
    [[nodiscard]] Expected<void> checkHidden(const Edit& edit) const;
    /// Takes the values of existing Transforms out of the list: where it wants them stands in `wanted_`.
    void takeTransforms(ChangeList& list, const Wishes& wishes);
    void commitPoses(Wishes& wishes, const StepResult& step);
    /// Pauses, in `list`, who drives what is taken in hand, unless the list itself says something of them.
    static void pause(std::span<const Actor::Driver> drivers, ChangeList& list);
    void follow(std::span<const Actor::Afterwards> afterwards);
    [[nodiscard]] ServersHand hand() {
        return ServersHand(committer_, [this](const ChangeList* list) { sceneChanged(list); });
    }
    /// After each list applied to the scene; null: anything may have changed.
    void sceneChanged(const ChangeList* list);
    /// The same of all but the collision pipeline.
    void othersSceneChanged(const ChangeList* list);

    /// An edit whose parts come; the history has the ways back.
    struct Arriving {
        std::uint64_t ticket = 0;
        IdRange ids;
        bool seen = false;  ///< some of it
    };
    /// Parts that nobody goes on with go again, once no other step is under way.
    void takeOrphansAway();

    std::size_t maxObjects_;
    Committer committer_;
    EditHistory history_;
    std::vector<OpenStep> openSteps_;  ///< of this frame
    Wishes wishes_;                    ///< of this frame
    ById<Pose> wanted_;                ///< of one edit
    std::optional<Arriving> arriving_;
    std::optional<EditOutcome> awaited_;  ///< of the step under way, where somebody waits for it
    const TimeSource& time_;
    std::unique_ptr<Workers> workers_;  ///< null: one thread
    CollisionPipeline pipeline_;
    ServersNodes serversNodes_;
    Typesetter typesetter_;
    std::vector<std::string> textNotes_;                                 ///< of this frame
    std::unique_ptr<StepActors> step_ = std::make_unique<StepActors>();  ///< rows look at them
    ActorTable actors_;
};

}  // namespace tessera
