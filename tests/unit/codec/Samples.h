/// What travels in the bodies of messages, with something in every field: a list, a frame, and one of everything that
/// applications say and are told.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/Motion.h"
#include "common/cores/Node.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera::test {

inline Blob blobOf(int seed) {
    return Blob::of(std::span<const int>(std::array{seed, seed + 1, seed + 2}));
}

/// One of everything that a list can hold.
inline ChangeList richList(const Blob& blob) {
    ChangeListBuilder b;
    b.create(ObjectId(7), typeOf<Node>());
    b.create(ObjectId(~0ull), typeOf<Geometry>());
    b.place(ObjectId(7), kRootNode, 3);
    b.detach(ObjectId(9));
    b.set(ObjectId(1), typeOf<Material>(), fieldId<&Material::baseColor>,
          toValue(Vec4f(0.25f, 1, 2, std::numeric_limits<float>::denorm_min())));
    b.set(ObjectId(3), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1e-300, -0.0, 1e300)));
    b.set(ObjectId(2), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    b.set(ObjectId(3), typeOf<Motion>(), fieldId<&Motion::mode>, std::numeric_limits<std::int64_t>::min());
    b.set(ObjectId(4), typeOf<Node>(), fieldId<&Node::core>, ObjectId(5));
    b.set(ObjectId(4), typeOf<Node>(), fieldId<&Node::name>, std::string("Größe\0x", 9));
    b.set(ObjectId(5), typeOf<Node>(), fieldId<&Node::name>, std::string());
    b.set(ObjectId(6), typeOf<Geometry>(), fieldId<&Geometry::positions>, blob);
    b.set(ObjectId(8), typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob());
    // Kinds that travel whatever types there are: the codec knows no schema.
    b.set(ObjectId(12), ObjectType(500), FieldId(1), true);
    b.set(ObjectId(13), ObjectType(500), FieldId(1), false);
    b.set(ObjectId(12), ObjectType(500), FieldId(2), RefList{ObjectId(3), ObjectId(~0ull)});
    b.set(ObjectId(13), ObjectType(500), FieldId(2), RefList());
    b.set(ObjectId(12), ObjectType(500), FieldId(3), Matrix{{1, -0.0, 3, 1e300}});
    b.setRange(ObjectId(6), typeOf<Geometry>(), fieldId<&Geometry::positions>, 4, blobOf(2));
    b.setRange(ObjectId(6), typeOf<Geometry>(), fieldId<&Geometry::positions>, 0, blobOf(1));
    b.destroy(ObjectId(11));
    ChangeList list = b.take();
    list.ranges.back().result = Blob::absent({7, 8}, 12);
    list.nextFreeId = 1ull << 62;
    return list;
}

inline View someView() {
    View view;
    view.position = Vec3d(1, 2, 3.5);
    view.orientation = Quatd(0.5, -0.5, 0.5, 0.5);
    view.worldUnitsPerMetre = 1000;
    User user;
    user.name = "Käthe";
    user.position = Vec3d(0.1, 1.6, 2);
    user.orientation = Quatd(0, 0, 1, 0);
    user.eyeSeparationMetres = 0.06;
    view.users = {user, User()};
    return view;
}

inline FramePayload someFrame() {
    View view = someView();
    view.studio = Studio{.middle = Vec3d(1.5, -2, 1e7), .reach = 0.75};
    view.exposure = {.wish = {.stops = 0.5, .metered = true, .toneMap = ToneMap::kAgx}, .found = -1234};
    return {view, {.contacts = 1000, .begun = 2, .ended = 3, .near = 4, .nearest = 0.1}, Showing::kTestPicture};
}

inline SharedBytes some(std::size_t size) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 37 + size);
    return share(std::move(bytes));
}

inline answer::Contacts twoContacts() {
    answer::Contacts contacts{100_frame, 7, {}};
    contacts.contacts.push_back({ObjectId{3}, ObjectId{4}, 5, 6, Vec3d(0.1, -2, 1e300), Vec3d(0, 1, 0)});
    contacts.contacts.push_back({ObjectId{8}, ObjectId{~0ull >> 1}, 0xffffffffu, 0, Vec3d(-0.0, 2, 3), Vec3d(1, 0, 0)});
    return contacts;
}

inline PairEventValue anEvent() {
    return {.interest = ObjectId{50},
            .objectA = ObjectId{51},
            .objectB = ObjectId{52},
            .phase = TouchPhase::kEnded,
            .firstTime = 0.25,
            .point = Vec3d(53, 54, 55),
            .normal = Vec3d(0, 0, 1),
            .through = true};
}
inline PairDistanceValue aDistance() {
    return {.interest = ObjectId{60},
            .objectA = ObjectId{61},
            .objectB = ObjectId{62},
            .phase = TouchPhase::kStays,
            .distance = 0.125,
            .nodeA = ObjectId{63},
            .nodeB = ObjectId{64},
            .faceA = 65,
            .faceB = 66,
            .pointA = Vec3d(67, 68, 69),
            .pointB = Vec3d(70, 71, 72),
            .error = 0.0625};
}
inline QuestionValue aQuestion() {
    QuestionValue question{.id = 80,
                           .interest = ObjectId{81},
                           .objectA = ObjectId{82},
                           .objectB = ObjectId{83},
                           .transform = ObjectId{84},
                           .present = {},
                           .wanted = {},
                           .point = Vec3d(85, 86, 87),
                           .normal = Vec3d(1, 0, 0)};
    question.wanted.translation = Vec3d(88, 89, 90);
    return question;
}

inline std::vector<ObjectInfo> twoObjects() {
    return {{.id = ObjectId{2},
             .type = ObjectType{1},
             .parent = ObjectId{1},
             .core = ObjectId{3},
             .coreType = ObjectType{2},
             .children = 1'000'000,
             .movable = ObjectId{2},
             .path = "/hall"},
            {.path = "there is no object with this id"}};
}

inline std::vector<ApplicationRequest> everyRequest() {
    ViewWish view;
    view.position = Vec3d(1, 2, 3);
    view.orientation = Quatd(0.5, -0.5, 0.5, -0.5);
    view.worldUnitsPerMetre = 1000;
    view.user = "viewer";
    view.head = Vec3d(0, 1.7, 2.4);
    view.reset = true;
    return {request::ProposeChanges{some(300), {some(0), some(200)}, 4711},
            request::UndoStep{},
            request::GetStatus{},
            request::LoadFile{"models/2CylinderEngine.glb",
                              ObjectId{17},
                              {.at = Vec3d(1, 2, 3), .scale = 0.5, .up = UpAxis::kZ, .pointRadius = 0.25},
                              true,
                              {"/Chair:color=red", "/Hall:light=night"}},
            request::SetView{view},
            request::PickAt{{12.5, -3, ""}},
            request::GetContacts{},
            request::GetImages{},
            request::SubscribeNews{{true, false, true}},
            request::GetEvents{},
            request::GetDistances{},
            request::GetQuestions{},
            request::AnswerQuestion{{.question = 5, .decision = QuestionReply::Decision::kMove}},
            request::RedoStep{},
            request::GetObjects{{{"/hall/crane", "#17"}, false, true, true}},
            request::GetTree{{.node = ObjectId{3},
                              .levels = 4,
                              .after = {ObjectId{3}, ObjectId{9}},
                              .coreType = ObjectType{5},
                              .cores = {ObjectId{6}, ObjectId{7}},
                              .pageSize = 8}},
            request::RemoveNode{ObjectId{8}},
            request::GetTrackers{},
            request::ShowPicture{Showing::kCountedTestPicture},
            request::NavigateView{
                {.mode = NavigationMode::kWalk,
                 .deed = NavigationWish::Deed::kGoToBookmark,
                 .node = ObjectId{9},
                 .bookmark = 3,
                 .input = InputState{.source = 1, .held = 1, .wheel = ~0ull, .right = -32767, .cursorX = 5}}},
            request::CloneNode{{.node = ObjectId{11},
                                .under = ObjectId{12},
                                .name = "twin",
                                .deep = true,
                                .shareTypes = {ObjectType{5}},
                                .shareObjects = {ObjectId{13}, ObjectId{14}}}},
            request::FindNodes{{.expression = "/hall/**/wheel*[visible]",
                                .node = ObjectId{3},
                                .coreType = ObjectType{4},
                                .pageSize = 17,
                                .after = {ObjectId{3}, ObjectId{9}}}},
            request::SetBudget{16.5},
            request::SetExposure{{.stops = -2.5, .metered = true, .toneMap = ToneMap::kAces}, true},
            request::MoveNode{.node = ObjectId{15},
                              .move = {.translation = Vec3d(1, 2, 3),
                                       .rotation = Quatd(0.5, -0.5, 0.5, -0.5),
                                       .scale = Vec3d(4, 5, 6),
                                       .relative = true},
                              .gesture = 4712},
            request::LoadAsset{"2CylinderEngine.glb", ObjectId{18}, {.fit = 2.5, .up = UpAxis::kY}, true},
            request::GrabHandle{{.xPx = 3.5, .yPx = 4.5, .wand = "w", .ray = Ray{Vec3d(1, 2, 3), Vec3d(0, 0, -1)}}},
            request::DragHandle{{.xPx = 5.5, .wand = {}}},
            request::ReleaseHandle{},
            request::MeasureDistance{.from = Vec3d(1, 2, 3), .to = Vec3d(4, 5, -6)},
            request::WhoAmI{},
            request::GetArray{.blob = "8fbc75bd6f0e8d5b6d33266de7325ff5", .offset = 31, .length = 32},
            request::GetPreview{4, 40},
            request::GetWall{},
            request::GetSteps{},
            request::GetPeople{},
            request::GetPanel{"b.2a"},
            request::GetFiles{{.folder = "/srv/models", .after = "hall.glb", .pageSize = 43}},
            request::GetLoads{},
            request::CancelLoad{7}};
}

inline std::vector<ApplicationAnswer> everyAnswer() {
    answer::Status status;
    status.wallName = "2x2";
    status.epoch = 11_epoch;
    status.frame = 12_frame;
    status.sequence = 13_seq;
    status.stateHash = StateHash(~0ull);
    status.hosts = {{"lower-left", "live", 14_frame, 0.25}, {"lower-right", "lost", 15_frame, 0}};
    status.waitingFor = {"lower-left"};
    status.objects = 16;
    status.nodes = 17;
    status.undoDepth = 18;
    status.redoDepth = 20;
    status.applications = 19;
    status.journal = "/var/lib/wall";
    status.journalTrouble = "no space left";
    status.waits = {{"front-1-0", "lower-right", 61, 250.5, "draw"}};
    status.waitFrames = 120;
    status.navigation = "walk";
    status.steering = {"lower-left", "application 7"};
    status.budgetMs = 16.5;
    status.detail = 3;
    status.exposure = {.stops = 1.5, .metered = false, .toneMap = ToneMap::kReinhard};
    status.meteredStops = -6.25;
    status.programs = {"SurfaceProgram #12 is heavy: it held up"};
    status.frames = {33, 16.25, 17.5};
    status.barrier = {34, 0.125, 0.5};
    status.sentBytes = 35;
    status.receivedBytes = 36;
    status.journalBytes = 37;
    const ObjectId placeholder{kFirstPlaceholder + 5};
    return {
        answer::Done{},
        answer::Committed{Sequence{21}, {{placeholder, ObjectId{22}}}, {ObjectId{23}, ObjectId{24}}, 25, 26},
        status,
        answer::Loaded{ObjectId{25}, 26, 27, {"skins are shown at rest", ""}, true, 28, 29, 30, 31},
        answer::Picked{true, ObjectId{28}, 29, Vec3d(1, 2, 3), 30.5, 31.5, 2.5, Vec3d(0, 0, 1), Vec2d(0.25, 0.5),
                       Vec2d(0.125, 0.75)},
        twoContacts(),
        answer::Images{{{"front-0-0", "a", 32_frame, some(100)}, {"front-1-0", "b", 33_frame, some(5)}}, {"front-0-1"}},
        answer::PairEvents{1_frame, {anEvent()}, 2},
        answer::Distances{1_frame, {aDistance()}, 2},
        answer::Questions{1_frame, {aQuestion()}, {3, 4}, 2},
        answer::Objects{34_seq, twoObjects(), some(60), {{.origin = Vec3d(1, 2, 3)}, {.xAxis = Vec3d(0, 0, -2)}}},
        answer::TreePage{
            35_seq, {{ObjectId{1}, ObjectId{}, 2}, {ObjectId{3}, ObjectId{1}, 0}}, some(70), {ObjectId{1}}},
        answer::Trackers{{{"art",
                           "dtrack",
                           "0.0.0.0:5000",
                           "cut",
                           1,
                           2,
                           3,
                           4,
                           {{"body 0", "head viewer", 5, 6, 60.5, 7.5, 0.25, 9}}}}},
        answer::FoundPage{36_seq, twoObjects(), {ObjectId{1}, ObjectId{5}}, 37},
        answer::Identity{"table", Role::kEditor},
        answer::ArrayPiece{38, share(Bytes{std::byte{1}, std::byte{2}, std::byte{3}})},
        answer::Preview{41, {{"front-0-0", "a", 42_frame, some(30)}}, {"front-0-1"}},
        answer::WallPlan{"cave",
                         {{"front", Vec3d(-1, 0, 0), Vec3d(1, 0, 0), Vec3d(-1, 2, 0), 1920, 1080, 1900, 1060}},
                         {{"front-0-0", "front", "a", "viewer", Eye::kLeft, 1, 2, 960, 540, Vec3d(-1, 0, 0),
                           Vec3d(0, 0, 0), Vec3d(-1, 1, 0), Vec3d(-0.03, 1.7, 2.4), 3, 4}},
                         {{"viewer", Vec3d(0, 1.7, 2.4)}},
                         Vec3d(4, 5, 6),
                         Quatd(0.5, 0.5, -0.5, 0.5),
                         1.5},
        answer::Measured{.from = Vec3d(1, 2, 3),
                         .to = Vec3d(4, 5, -6),
                         .distance = 9.5,
                         .error = 0.25,
                         .node = ObjectId{38},
                         .face = 39,
                         .normal = Vec3d(0, 1, 0)},
        answer::People{{{"ada", "console", Role::kEditor, 2.5, true}}, 43},
        answer::Steps{44_seq, {"sets Transform.translation of /crane", {ObjectId{45}}, 46}, {}},
        answer::PanelState{"b.2b",
                           true,
                           "hall",
                           {{.kind = PanelKind::kPress,
                             .label = "evening",
                             .fault = "gone",
                             .now = {ObjectId{40}, ObjectType{6}, "intensity", {0.5, 1.5}, false, "words"},
                             .unit = "s",
                             .least = -1,
                             .greatest = 2,
                             .step = 0.25,
                             .bytes = 41,
                             .options = {{"near", {ObjectId{42}, ObjectType{7}, "on", {}, true, {}}}},
                             .sets = {{ObjectId{43}, ObjectType{8}, "name", {}, {}, "x"}},
                             .bookmark = 3,
                             .home = true}}},
        answer::FolderPage{
            {{"hall.glb", "/srv/models/hall.glb", false, 44, true}, {"parts", "/srv/models/parts", true, 0, false}},
            "parts"},
        answer::Loads{{{7, "/srv/models/hall.glb", "reading", 0.25, 3.5, "ada", true},
                       {8, "asset://box.tsct", "waiting", -1, 0.5, {}, false}}}};
}

inline notice::Poses somePoses() {
    return {41_frame,
            {{"viewer", true, 42, Vec3d(1, 2, 3), Quatd(0.5, 0.5, -0.5, 0.5)}},
            {{"right", true, 43, Vec3d(4, 5, 6), Quatd(0, 1, 0, 0), Vec3d(7, 8, 9), Quatd(0, 0, 1, 0), 5, {0.5, -1}}}};
}

inline std::vector<ApplicationNotice> everyNotice() {
    return {
        notice::Frame{40_frame, {"a", "b"}, {"c"}, 16.5, 1234.5, {{"a", 9.5, 8.5, 0.5, 1.5, 4.5, 1.25, 39_frame, 2.5}}},
        twoContacts(),
        answer::Picked{true, ObjectId{28}, 29, Vec3d(1, 2, 3), 30.5, 31.5, 2.5, Vec3d(0, 0, 1), Vec2d(0.25, 0.5),
                       Vec2d(0.125, 0.75)},
        answer::PairEvents{1_frame, {anEvent(), PairEventValue{}}, 2},
        answer::Distances{1_frame, {aDistance()}, 2},
        answer::Questions{1_frame, {aQuestion()}, {3, 4}, 2},
        somePoses(),
        notice::States{{{"lower-left", "live", 47_frame, 0.25}}, "no space left", 48, 49}};
}

}  // namespace tessera::test
