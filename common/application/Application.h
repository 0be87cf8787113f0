/// An application's door to a running wall: connect, follow the scene, propose changes, be told what happens.
///
///     auto application = tessera::Application::connect({.address = "127.0.0.1:7000", .name = "mover"});
///     if (!application) …  // application.error().message says why, for a person
///     (*application)->moveNode("/hall/crane", {.translation = tessera::Vec3d(1, 0, 0), .relative = true});
///
/// One thread owns an Application and calls all its members: "the caller". Connection, heartbeats and decoding run on
/// threads inside; nothing of the caller's is touched from there: the scene changes, and callbacks are called, only
/// within `poll` and the other members that say so. Where two want the same node: see README.md beside this file.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/application/SceneExcerpt.h"
#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/request/Requests.h"
#include "common/scene/Aspect.h"
#include "common/scene/Edits.h"
#include "common/wall/Wall.h"

namespace tessera {

struct Platform;

class Application {
public:
    struct Options {
        /// "HOST:PORT" of the server; empty: TESSERA_SERVER, else that in this user's file (common/access), else the
        /// one server of this user on this machine.
        std::string address;
        std::string name = "application";  ///< for the server's log and status
        std::string tokenFile = {};  ///< whose first line lets it in; empty: TESSERA_TOKEN_FILE, else what the server
                                     ///< of this user has left on this machine
        std::string keys = {};  ///< folder with a person's key, or that key's file: links are sealed. Empty: plain ones
        bool followScene = true;                    ///< false: `scene()` stays empty, and nothing of it is sent here
        bool wantBlobs = false;                     ///< meshes and pixels too; false: their handles are absent (Blob)
        std::chrono::milliseconds timeout{10'000};  ///< for connecting and for each request
        /// A connection that breaks later (the server was killed, the cable cut) is dialled again for so long; 0:
        /// never.
        std::chrono::milliseconds redial{60'000};
    };

    /// Returns when the scene is there (with followScene), else when the server has answered. kNetwork: nobody there,
    /// no Tessera server, too slow; other codes: refused by the server.
    [[nodiscard]] static Expected<std::unique_ptr<Application>> connect(const Options& options);
    /// The same on another's time, network and threads (common/net/Platform.h).
    [[nodiscard]] static Expected<std::unique_ptr<Application>> connect(const Options& options,
                                                                        const Platform& platform);
    /// Sends what is queued and takes leave; takes at most about a second.
    ~Application();
    Application(const Application&) = delete;
    Application& operator=(const Application&) = delete;

    // ---- the scene

    /// As of the last list applied here. References into it hold until the next call that applies lists.
    [[nodiscard]] const Aspect& scene() const;
    /// Number of the last list applied here.
    [[nodiscard]] Sequence sequence() const;
    /// The wall that the server drives, as its configuration says.
    [[nodiscard]] const Wall& wall() const;

    /// Applies everything that has arrived, calling the callbacks; waits for something for at most `timeout`. False:
    /// nothing came. An error ends it: the connection is gone for good (`serverIsOver` tells a regular end from a
    /// broken one). One that broke is dialled again meanwhile: `onLost`, `onBack`.
    [[nodiscard]] Expected<bool> poll(std::chrono::milliseconds timeout);
    /// Polls until the wall has shown a frame that was not reported here before. Needs `onFrame` or subscribes by
    /// itself. kNetwork also when none is shown within `timeout`.
    [[nodiscard]] Expected<notice::Frame> waitForFrame(std::chrono::milliseconds timeout);
    [[nodiscard]] bool serverIsOver() const;
    /// False: it broke and is dialled again by `poll` and by whatever waits, or has ended. A request that was under way
    /// then ends with kNetwork, and may have been done or not; one that is made meanwhile waits for the return.
    [[nodiscard]] bool connected() const;

    // ---- the scene as it is at the server, for those who do not follow it: each question costs its answer

    /// What stands at a node's path ("/hall/crane") or at the id of any object ("#17"). kNotFound says which step
    /// failed and what is there instead.
    [[nodiscard]] Expected<ObjectInfo> describe(const std::string& name);
    /// The same where only a node will do.
    [[nodiscard]] Expected<ObjectInfo> describeNode(const std::string& name);
    /// In their order; `id` is none of what is not there.
    [[nodiscard]] Expected<std::vector<ObjectInfo>> describe(std::span<const std::string> names);
    /// These objects with their fields, and the cores of those that are nodes. What is not there is missing.
    [[nodiscard]] Expected<SceneExcerpt> fetch(std::span<const ObjectId> objects);
    /// A node and what is below it, with all fields, page by page; `wanted.after` does not count. The server goes on
    /// meanwhile: what comes, goes or moves while the pages come is told as some page saw it, or not at all.
    [[nodiscard]] Expected<SceneExcerpt> fetchTree(TreeWish wanted);

    /// A page of the nodes that an expression names ("/hall/**/wheel*", "//*[Geometry]": common/scene/Search.h), in the
    /// order of the document. It tells something, or is the last: `next` is empty then. Else `next` as `after` asks for
    /// the one behind it. The server goes on meanwhile: what stays in its place is found, what comes, goes or moves may
    /// be found or not.
    [[nodiscard]] Expected<answer::FoundPage> find(NodeSearch wanted);

    // ---- callbacks: called by the caller's own thread, within `poll` and whatever else applies lists

    /// After a list was applied; the scene is already the new one. The first call of a (re)started scene gets the
    /// whole.
    void onChanges(std::function<void(const ChangeList&, Sequence)> callback);
    /// The connection broke, and why; it may be there again already. Until the whole scene has come anew (`onBack`),
    /// `scene()` stays what it was, and what was found in it is not sent (`propose`, `moveNode`: kNetwork).
    void onLost(std::function<void(const Error&)> callback);
    /// It is back: the whole scene has been applied, as onChanges was told, and what was subscribed to comes again.
    /// Without a journal the server may have begun anew, and an id may mean something else.
    void onBack(std::function<void()> callback);
    /// The contacts of every frame, as it is made.
    [[nodiscard]] Expected<void> onContacts(std::function<void(const answer::Contacts&)> callback);
    /// Which objects began or ceased to touch, frame by frame; a frame without any comes with an empty list. With
    /// `stays` also those that go on touching, in every frame.
    struct PairEventOptions {
        bool stays = false;
    };
    [[nodiscard]] Expected<void> onPairEvents(std::function<void(const answer::PairEvents&)> callback,
                                              PairEventOptions options);
    [[nodiscard]] Expected<void> onPairEvents(std::function<void(const answer::PairEvents&)> callback) {
        return onPairEvents(std::move(callback), PairEventOptions());
    }
    /// What is nearer than the threshold of its distance interest, frame by frame.
    [[nodiscard]] Expected<void> onDistances(std::function<void(const answer::Distances&)> callback);
    /// What interests with the response "ask" want to know, and which questions are closed: first those that are open
    /// already, then in each frame that asks or closes any. To answer, call `respond`, from within the callback or
    /// later; the frames go on meanwhile, and after the interest's patience nobody is asked any more.
    [[nodiscard]] Expected<void> onQuestions(std::function<void(const answer::Questions&)> callback);
    /// Whenever anybody picks.
    [[nodiscard]] Expected<void> onPick(std::function<void(const answer::Picked&)> callback);
    /// Whenever the wall has shown a frame.
    [[nodiscard]] Expected<void> onFrame(std::function<void(const notice::Frame&)> callback);

    /// How hosts are, whether edits are taken, who has come or gone: at once, then whenever one of these is another.
    [[nodiscard]] Expected<void> onStates(std::function<void(const notice::States&)> callback);

    /// Heads and wands of every frame, as it is made, before it is drawn; a wall without trackers tells of its users
    /// alone.
    [[nodiscard]] Expected<void> onPoses(std::function<void(const notice::Poses&)> callback);

    // ---- requests: each waits for the server's answer, at most Options::timeout. What is out of the bounds of its
    // description (common/request) is not sent: kBadInput, kLimit, with the member's name.

    /// Asks the server to commit `list`; objects it creates carry placeholders (ids from kFirstPlaceholder up).
    /// Resident blobs that it names are uploaded, large ones in pieces while frames go by; Options::timeout counts
    /// meanwhile. Those that the server took earlier, or has sent, are not, as long as it has them and they are in
    /// memory here. kLimit: more than limits::kMaxUploadBytes (1 GiB) of them, or a list of more than
    /// limits::kMaxProposalBytes (64 MiB): nothing is sent. When it returns, `scene()` holds the change (with
    /// followScene; not from within a callback). A refused list changes nothing. `gesture`: proposals in a row of one
    /// gesture (a drag) are taken back as one; 0: each by itself.
    [[nodiscard]] Expected<answer::Committed> propose(const ChangeList& list, std::uint64_t gesture = 0);
    /// Takes back the last committed change of any application, as a new change. Of a large load or copy: told when
    /// nobody sees any of it.
    [[nodiscard]] Expected<answer::Committed> undo();
    /// Does again what was taken back last; nothing can be done again after another change.
    [[nodiscard]] Expected<answer::Committed> redo();
    /// Moves the node at a path ("/hall/crane") or id ("#17"): its Transform, or the nearest above it. The server works
    /// out where that leads, in the frame that makes the edit: of several who move the same node by so much, all count.
    /// What collides is stopped as with `propose`. kRefused: no node up to the root holds a Transform. kUsage: a scale
    /// of zero, or nothing to do. `gesture` as in `propose`.
    [[nodiscard]] Expected<answer::Committed> moveNode(const std::string& node, const NodeMove& move,
                                                       std::uint64_t gesture = 0);
    /// The same of a node that `describe` has told of.
    [[nodiscard]] Expected<answer::Committed> moveNode(const ObjectInfo& node, const NodeMove& move,
                                                       std::uint64_t gesture = 0);
    /// Removes a node with everything below it, and what only they used (`removalList` in Edits.h; the server makes
    /// it).
    [[nodiscard]] Expected<answer::Committed> removeNode(ObjectId node);
    /// A node with everything below it once more (`cloneList` in common/scene/Clones.h; the server makes it): one step
    /// of undo. The copy is `ids.front().second`.
    [[nodiscard]] Expected<answer::Committed> cloneNode(const CloneWish& wish);
    /// The server imports a file of its own, or one of its assets ("asset://NAME"), and adds it below `parent` (none:
    /// the root), under a Transform of its own, named after the file, where it is a model, a scene of several top
    /// nodes, or the placing says anything.
    ///
    /// kIfThere: a file which is in the scene already (below `parent`, where one is said) is taken in again in its
    /// place: what has changed in it, without what people have changed since. Says `reloaded` then.
    enum class Reload : bool { kNever, kIfThere };
    [[nodiscard]] Expected<answer::Loaded> load(const std::string& path, ObjectId parent = {},
                                                std::chrono::milliseconds timeout = std::chrono::minutes(10),
                                                const Placing& placing = {}, Reload reload = Reload::kNever);
    /// The same, and `tell` hears four times a second how far it is (of nothing but the path, before that is known).
    /// False from it cancels the load, which then ends as any that fails. It may not call this Application.
    [[nodiscard]] Expected<answer::Loaded> load(const std::string& path, ObjectId parent,
                                                std::chrono::milliseconds timeout, const Placing& placing,
                                                Reload reload, const std::function<bool(const LoadState&)>& tell);
    /// Files that are on their way into the scene, whoever asked for them.
    [[nodiscard]] Expected<answer::Loads> loads();
    /// Ends one of them. kRefused: it appears already. kNotFound: it is not on its way (any more).
    [[nodiscard]] Expected<void> cancelLoad(std::uint64_t load);
    [[nodiscard]] Expected<void> setView(const ViewWish& view);
    /// The scene, or a test picture, on all tiles from the next frame on.
    [[nodiscard]] Expected<void> show(Showing showing);
    /// Milliseconds that hosts may take for a frame before detail is left away (common/wall/Detail.h); 0: none is.
    [[nodiscard]] Expected<void> setBudget(double milliseconds);
    /// How bright the wall shows its scene, in place of what the scene's Environment says; what is absent stays, as it
    /// is now or (`reset`) as the scene says.
    [[nodiscard]] Expected<void> setExposure(const ExposureWish& wish, bool reset = false);
    /// Flies, walks, goes home, to a bookmark, to a node: as a person at a window would. Input that is held stays held
    /// until another one is said, or this application leaves. kRefused: the server takes no input.
    [[nodiscard]] Expected<void> navigate(const NavigationWish& wish);
    /// What is under a pixel of the mosaic of the first screen, from its upper left.
    [[nodiscard]] Expected<answer::Picked> pick(double xPx, double yPx) {
        return pick(Aim{.xPx = xPx, .yPx = yPx, .wand = {}});
    }
    /// What a wand points at: the nearest triangle along its -Z. kRefused: it is not tracked at present.
    [[nodiscard]] Expected<answer::Picked> pick(const std::string& wand) { return pick(Aim{.wand = wand}); }
    /// Either, or what is along a ray of the world.
    [[nodiscard]] Expected<answer::Picked> pick(const Aim& aim);
    /// How far it is from a place of the world to another, or to the nearest surface that is seen at or below a node.
    /// kNotFound: nothing is. kLimit: too much stands in between.
    [[nodiscard]] Expected<answer::Measured> measure(const Vec3d& from, const std::optional<Vec3d>& to,
                                                     ObjectId node = {});
    [[nodiscard]] Expected<answer::Measured> measure(const Vec3d& from, ObjectId node) {
        return measure(from, std::nullopt, node);
    }
    /// Takes hold of a manipulator's handle (server/manipulators); `hit` is false where there is none. `node` is the
    /// manipulator's, `face` the handle's number. kRefused: somebody else holds it, or its target is driven. What was
    /// held before is let go.
    [[nodiscard]] Expected<answer::Picked> grab(const Aim& aim);
    [[nodiscard]] Expected<answer::Picked> grab(const Ray& ray) { return grab(Aim{.wand = {}, .ray = ray}); }
    /// Leads what is held to where the ray is now: all drags of one grab are one step of undo, and what collides stops
    /// as with `moveNode`. A ray that says nothing (beside the plane, behind the eye) leaves all as it is. kRefused:
    /// nothing is held.
    [[nodiscard]] Expected<answer::Committed> drag(const Aim& aim);
    [[nodiscard]] Expected<answer::Committed> drag(const Ray& ray) { return drag(Aim{.wand = {}, .ray = ray}); }
    /// Lets go. Whoever leaves lets go as well.
    [[nodiscard]] Expected<void> release();
    /// A page of what lies in a folder from which files may be loaded.
    [[nodiscard]] Expected<answer::FolderPage> files(const FolderWish& wish);
    /// What the wall's trackers say, and how well.
    [[nodiscard]] Expected<answer::Trackers> trackers();
    /// What the newest frame found.
    [[nodiscard]] Expected<answer::Contacts> contacts();
    [[nodiscard]] Expected<answer::PairEvents> pairEvents();  ///< those that stay included
    [[nodiscard]] Expected<answer::Distances> distances();
    /// All that are open now.
    [[nodiscard]] Expected<answer::Questions> questions();
    /// Decides a question; the next frame does it. `pose` counts with kMove: the value that the question's transform
    /// gets. kRefused: the question is not open, because somebody has answered it or nobody did in time.
    [[nodiscard]] Expected<void> respond(std::uint64_t question, QuestionReply::Decision decision,
                                         const Pose& pose = {}) {
        return respond(QuestionReply{question, decision, pose});
    }
    [[nodiscard]] Expected<void> respond(const QuestionReply& reply);
    [[nodiscard]] Expected<answer::Status> status();
    /// As whom the server knows this application, and what it may do.
    [[nodiscard]] Expected<answer::Identity> whoAmI();
    [[nodiscard]] Expected<answer::People> people();
    /// Where the wall's screens, tiles and users are, and where the wall itself stands in the world now.
    [[nodiscard]] Expected<answer::WallPlan> plan();
    /// What `undo` and `redo` would do, if nobody edits before.
    [[nodiscard]] Expected<answer::Steps> steps();
    /// The tiles as they are shown now, all of the same frame. The server waits while hosts draw, a minute at most.
    [[nodiscard]] Expected<answer::Images> images(std::chrono::milliseconds timeout = std::chrono::minutes(2));

private:
    struct Impl;
    explicit Application(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
