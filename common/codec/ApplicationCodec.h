/// What applications ask and what they are told (proto/application.proto): the body of Request, Reply and Notice.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/change/Value.h"
#include "common/codec/ApplicationCollision.h"
#include "common/codec/ApplicationManipulation.h"
#include "common/codec/ApplicationNavigation.h"
#include "common/codec/ApplicationScene.h"
#include "common/codec/ApplicationTracking.h"
#include "common/codec/Showing.h"
#include "common/math/NodeMove.h"
#include "common/math/Placing.h"
#include "common/math/Types.h"

namespace tessera {

namespace request {

/// An encoded ChangeList (ChangeCodec); new objects carry placeholders. Blobs it names are uploaded in `blobs`. Proposals in a row
/// of one gesture of one application are one step of undo (0: none).
struct ProposeChanges {
    ByteSlice list;
    std::vector<ByteSlice> blobs;
    std::uint64_t gesture = 0;
};
struct UndoStep {};
struct RedoStep {};
struct GetStatus {};
/// Imports a file on the server and adds it below `parent` (0: the root).
struct LoadFile {
    std::string path;
    ObjectId parent;
    Placing placing = {};
};
/// What stands at these names: a node's path, or "#17" of any object.
struct GetObjects {
    std::vector<std::string> names;
    bool paths = true;     ///< false: for who knows them
    bool content = false;  ///< their fields, and those of the nodes' cores, too
};
/// A page of the tree: `node` and what is below it, in the order of the document. What one page costs is bounded, however
/// large the scene is. A node that stays in its place while the pages are asked for is told, if `after` has been removed
/// or moved meanwhile perhaps twice; one that comes, goes or moves meanwhile may be told or not.
struct GetTree {
    static constexpr std::uint32_t kAllLevels = 0xffffffffu;

    ObjectId node = kRootNode;
    std::uint32_t levels = kAllLevels;  ///< below `node`
    std::vector<ObjectId> after;        ///< `TreePage::next` of the page before; empty: from the start
    // With either of these only nodes with such a core are told. A page may then be empty and not the last.
    ObjectType coreType;          ///< cores of this type
    std::vector<ObjectId> cores;  ///< these cores
};
/// Moves the nearest Transform from a node upwards. What "from where it is" means is worked out in the frame that makes
/// the edit, behind the edits before it: of several that move the same node by so much all count. `gesture` as in
/// ProposeChanges.
struct MoveNode {
    ObjectId node;
    NodeMove move;
    std::uint64_t gesture = 0;
};
/// Takes a node away with everything below it, and what only they used (`removalList`).
struct RemoveNode {
    ObjectId node;
};
/// A node with everything below it once more (`cloneList` in common/scene/Clones.h says what each means).
struct CloneNode {
    ObjectId node, under;
    std::string name;
    bool deep = false;
    std::vector<ObjectType> shareTypes;
    std::vector<ObjectId> shareObjects;
};
/// A page of the nodes that an expression finds (common/scene/PathPattern.h), in the order of the document. What one page costs is bounded,
/// however large the scene is: it may tell nothing and not be the last. While the pages are asked for the scene may change as with GetTree.
struct FindNodes {
    std::string expression;
    ObjectId node = kRootNode;  ///< the expression's "/": what is below it is searched
    ObjectType coreType;        ///< only nodes with such a core; none: any
    std::uint32_t pageSize = 256;  ///< nodes told at most; the server has a bound of its own
    std::vector<ObjectId> after;   ///< `FoundPage::next` of the page before; empty: from the start
};
/// Moves the wall in the world, or a user's head in the wall. Unset parts stay. `reset`: back to the scene's camera.
struct SetView {
    std::optional<Vec3d> position;
    std::optional<Quatd> orientation;
    std::optional<double> worldUnitsPerMetre;
    std::string user;
    std::optional<Vec3d> head;
    bool reset = false;
};
/// What the newest frame's collision detection found.
struct GetContacts {};
struct GetEvents {};  ///< those that stay included
struct GetDistances {};
/// All that are open.
struct GetQuestions {};
/// An answer to a question that is open; the first one counts, whoever gives it.
struct AnswerQuestion {
    enum class Decision : std::uint8_t {
        kStop,  ///< it stays where it was stopped
        kPass,  ///< it goes where it wanted to be
        kMove,  ///< it goes to `pose` instead
    };
    std::uint64_t question = 0;
    Decision decision = Decision::kStop;
    Pose pose;  ///< with kMove: value of the question's transform; no zero in its scale
};
/// The wall as it is now: one TileImage per tile.
struct GetImages {};
/// Each frame's data that is wanted from now on.
struct SubscribeNews {
    bool contacts = false, picks = false, frames = false;
    bool events = false;
    bool stays = false;  ///< with `events`: in every frame, pairs that go on touching too
    bool distances = false;
    bool questions = false;
    bool poses = false;
};
/// What the wall's trackers say, and how well.
struct GetTrackers {};

/// What all tiles show from the next frame on.
struct ShowPicture {
    Showing showing = Showing::kScene;
};
/// That hosts may take for a frame from the next one on before detail is left away (common/wall/Detail.h). 0: none is.
struct SetBudget {
    double milliseconds = 0;
};

}  // namespace request

using ApplicationRequest =
    std::variant<request::ProposeChanges, request::UndoStep, request::GetStatus, request::LoadFile, request::SetView,
                 request::PickAt, request::GetContacts, request::GetImages, request::SubscribeNews, request::GetEvents,
                 request::GetDistances, request::GetQuestions, request::AnswerQuestion, request::RedoStep,
                 request::GetObjects, request::GetTree, request::RemoveNode, request::GetTrackers, request::ShowPicture,
                 request::NavigateView, request::CloneNode, request::FindNodes, request::SetBudget, request::Manipulate,
                 request::MoveNode>;

namespace answer {

struct Committed {
    Sequence sequence;
    /// Ids given to the placeholders of the proposal; of a copy its node alone.
    std::vector<std::pair<ObjectId, ObjectId>> ids;
    /// Objects whose transforms the collision response kept from going where the proposal wanted them.
    std::vector<ObjectId> stopped;
    std::uint64_t removed = 0;  ///< objects that were removed
    std::uint64_t created = 0;  ///< objects that were copied
};
struct HostInfo {
    std::string name, state;
    FrameNumber lastShown;
    double roundTripMs = 0;
};
/// A tile that the others waited for, of late (512 frames at most).
struct TileWait {
    std::string tile, host;
    std::uint64_t frames = 0;
    double ms = 0;       ///< altogether
    std::string reason;  ///< what it spent more time on than they did, most of all; words of report.json
};
struct Status {
    std::string wallName;
    Epoch epoch;
    FrameNumber frame;
    Sequence sequence;
    StateHash stateHash;
    std::vector<HostInfo> hosts;
    std::vector<std::string> waitingFor;
    std::uint64_t objects = 0, nodes = 0, undoDepth = 0, redoDepth = 0, applications = 0;
    std::string journal;         ///< the server's folder; empty: what is done does not survive it
    std::string journalTrouble;  ///< why nothing is written at present, and no edit is taken; empty: all is well
    std::vector<TileWait> waits;  ///< those waited for longest first
    std::uint64_t waitFrames = 0;  ///< frames that `waits` looks at
    std::vector<std::string> trackers;  ///< a line for each
    std::string navigation;        ///< the mode in which people move: "fly", "orbit", "walk"; empty: the server takes no input
    std::vector<std::string> steering;  ///< who moves the wall now, or has in the last second: hosts and applications
    double budgetMs = 0;                ///< for a frame; 0: none
    unsigned detail = 0;                ///< step of kDetailSteps that the next frame is drawn at
    std::vector<std::string> programs;  ///< a line for each SurfaceProgram that is bad or heavy
};
struct Loaded {
    static constexpr std::size_t kMostNotes = 100;
    ObjectId node;  ///< the new node that holds the file's content
    std::uint64_t objects = 0, triangles = 0;
    std::vector<std::string> notes = {};  ///< what was left out or guessed, for people; no more than so many
};
struct Picked {
    bool hit = false;
    ObjectId node;
    std::uint32_t face = 0;
    Vec3d point = Vec3d::Zero();
    double xPx = 0, yPx = 0;
    double t = 0;                   ///< how far from where the ray begins (the eye, the wand), in world units
    Vec3d normal = Vec3d::Zero();   ///< of the face, world, of length 1, as its corners turn; zero of a ball and of a face without area
    Vec2d corners = Vec2d::Zero();  ///< barycentric: how much of the face's second and third corner
    std::optional<Vec2d> texcoord;  ///< of the first set, where the geometry has one
};
struct TileImageValue {
    std::string tile, host;
    FrameNumber frame;
    ByteSlice png;
};
struct Images {
    std::vector<TileImageValue> tiles;
    std::vector<std::string> missing;  ///< tiles of hosts that are not there
};
struct Done {};

}  // namespace answer

using ApplicationAnswer =
    std::variant<answer::Done, answer::Committed, answer::Status, answer::Loaded, answer::Picked, answer::Contacts,
                 answer::Images, answer::PairEvents, answer::Distances, answer::Questions, answer::Objects,
                 answer::TreePage, answer::Trackers, answer::FoundPage>;

namespace notice {
struct Frame {
    FrameNumber frame;
    std::vector<std::string> shown, held;
};
}  // namespace notice
using ApplicationNotice = std::variant<notice::Frame, answer::Contacts, answer::Picked, answer::PairEvents,
                                       answer::Distances, answer::Questions, notice::Poses>;

struct ApplicationLimits {
    std::size_t maxTextBytes = 4096;
    std::size_t maxBlobs = 65'536;   ///< of one proposal
    std::size_t maxIds = 8'000'000;  ///< given by one commit
    std::size_t maxContacts = 100'000;
    std::size_t maxEvents = 100'000;
    std::size_t maxDistances = 100'000;
    std::size_t maxQuestions = 4096;  ///< and ids of closed ones
    /// Of contacts, events, distances or questions in one notice or answer: what a Notice may carry at most.
    std::size_t maxCollisionBytes = std::size_t{16} << 20;
    std::size_t maxNames = 256;         ///< asked for at once
    std::size_t maxFilterCores = 4096;  ///< of one GetTree
    std::size_t maxShared = 4096;       ///< types, and objects, that one Clone shares
    std::size_t maxPageNodes = 4096;
    std::size_t maxDepth = 4096;  ///< nodes from a page's top to where the next one begins
    /// Of paths and of content in one answer, each.
    std::size_t maxSceneBytes = std::size_t{64} << 20;
    std::size_t maxTiles = 4096;
    std::size_t maxHosts = 4096;
};

/// Decoding never crashes whatever the bytes are and takes no memory out of proportion to them. Numbers that are not
/// finite and quaternions of no length are refused. kBadInput, kLimit.
/// Byte fields of what is decoded are slices of `bytes` and keep them.
[[nodiscard]] Bytes encodeRequest(const ApplicationRequest& request);
[[nodiscard]] Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits = {});
[[nodiscard]] Bytes encodeAnswer(const ApplicationAnswer& answer);
[[nodiscard]] Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits = {});
[[nodiscard]] Bytes encodeNotice(const ApplicationNotice& notice);
[[nodiscard]] Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits = {});

}  // namespace tessera
