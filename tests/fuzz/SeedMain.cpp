/// fuzz_seeds FOLDER: inputs to begin with, one folder per target; what a fuzzer would need very long to find by
/// itself.
#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "common/base/Hash.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/WallCodec.h"
#include "common/scenefile/SceneFile.h"
#include "server/sim/journal/JournalFormat.h"
#include "server/sim/recording/RecordingFormat.h"
#include "tests/fuzz/HostileShow.h"
#include "tests/fuzz/TrackerSeeds.h"
#include "tests/unit/AnyMessage.h"

namespace tessera {
namespace {

class Seeds {
public:
    explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {}
    void add(const std::string& target, const Bytes& bytes) const {
        std::filesystem::create_directories(folder_ / target);
        std::ofstream(folder_ / target / fmt::format("seed-{:016x}", hash64(bytes)), std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }

private:
    std::filesystem::path folder_;
};

Bytes operator+(Bytes a, ByteSpan b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}
Bytes byte(std::size_t value) {
    return {static_cast<std::byte>(value)};
}
Bytes lengthOf(ByteSpan bytes) {
    return {static_cast<std::byte>(bytes.size() & 0xff), static_cast<std::byte>(bytes.size() >> 8 & 0xff)};
}
Bytes contentOf(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const ByteSpan bytes = std::as_bytes(std::span(text.data(), text.size()));
    return {bytes.begin(), bytes.end()};
}

/// A message of each kind, filled as a running wall fills them.
std::vector<Message> messages() {
    std::vector<Message> all = test::sampleMessages();
    const Bytes list = encodeChangeList(test::bodyScene(Vec3d(0, -10, 0), Vec3d::Zero()));
    const Bytes view = encodeFrame({});
    for (Message& message : all) {
        if (auto* begin = std::get_if<message::Begin>(&message)) {
            CommittedList committed;
            committed.sequence = Sequence(3);
            committed.encoded = Bytes(list);
            committed.blobs = {{{1, 2}, 96}};
            begin->list = share(std::move(committed));
            begin->payload = Bytes(view);
        }
        if (auto* ready = std::get_if<message::Ready>(&message))
            ready->stats = encodeStats({{{"front-0-0", 1, 2, 3, 4, 5}}, 6, 7, 8});
        if (auto* request = std::get_if<message::Request>(&message))
            request->body = encodeRequest(request::GetStatus{});
        if (auto* welcome = std::get_if<message::Welcome>(&message))
            welcome->configuration = encodeWall(test::wallOfOne());
    }
    return all;
}

void write(const Seeds& seeds) {
    Bytes frames = byte(200);
    for (const Message& message : messages()) {
        const Bytes payload = encodeMessage(message).joined();
        seeds.add("messages", byte(wireType(message)) + payload);
        if (payload.size() < 512)
            frames = frames + byte(1) + byte(wireType(message)) + lengthOf(payload) + payload + byte(0);
    }
    seeds.add("frames", frames);
    const std::vector<ApplicationRequest> requests = {request::GetStatus{},
                                                      request::PickAt{{1, 2, ""}},
                                                      request::UndoStep{},
                                                      request::SetView{},
                                                      request::GetObjects{{{"/hall/crane", "#17"}}},
                                                      request::GetTree{{.after = {ObjectId{1}}}},
                                                      request::NavigateView{{.bookmark = 1, .input = InputState{}}}};
    for (const ApplicationRequest& request : requests) {
        message::Request message{7, encodeRequest(request)};
        seeds.add("messages", byte(wireType(message)) + encodeMessage(message).joined());
    }

    ChangeListBuilder builder;
    setField<&Transform::translation>(builder, ObjectId(3), Vec3d(1, 2, 3));
    setField<&Transform::rotation>(builder, ObjectId(5), Quatd(0, 1, 0, 0));
    builder.place(ObjectId(4), kRootNode);
    const Bytes edit = encodeChangeList(builder.take());
    builder.create(ObjectId(40), typeOf<Node>());
    builder.create(ObjectId(41), typeOf<Geometry>());
    setField<&Node::core>(builder, ObjectId(40), ObjectId(41));
    setField<&Node::name>(builder, ObjectId(40), std::string("new"));
    builder.place(ObjectId(40), ObjectId(2));
    const Bytes creation = encodeChangeList(builder.take());
    seeds.add("lists", lengthOf(edit) + edit);
    seeds.add("lists", lengthOf(creation) + creation + lengthOf(edit) + edit);

    for (std::uint64_t seed = 1; seed <= 24; ++seed) {  // whatever comes, it means something to these
        Bytes bytes;
        std::uint64_t state = seed;
        for (int i = 0; i < 240; ++i) {
            state = state * 6364136223846793005ull + 1442695040888963407ull;
            bytes.push_back(static_cast<std::byte>(state >> 56));
        }
        seeds.add("edits", bytes);
        seeds.add("sessions", byte(seed % 2) + bytes);
    }

    const std::filesystem::path root = TESSERA_SOURCE_DIR;
    for (const auto& entry : std::filesystem::directory_iterator(root / "deploy/walls"))
        if (entry.path().extension() == ".wall") seeds.add("walls", byte(0) + contentOf(entry.path()));
    seeds.add("walls", byte(1) + encodeWall(test::wallOfOne()));
    const std::string_view panel =
        "title: \"t\" controls { label: \"a\" node: \"/lamp\" field: \"intensity\" slider { least: 0 greatest: 4 } }\n"
        "controls { label: \"b\" node: \"/lamp\" field: \"on\" toggle {} }\n"
        "controls { label: \"c\" node: \"/else/cart\" field: \"translation\" choice { options { value: \"0 0 1\" } } "
        "}\n"
        "controls { label: \"d\" node: \"/cart\" field: \"name\" text { bytes: 8 } }\n"
        "controls { label: \"e\" node: \"/lamp\" field: \"color\" colour {} }\n"
        "controls { label: \"f\" press { sets { node: \"/else/lamp\" field: \"intensity\" value: \"1\" } home: true } "
        "}\n";
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        Bytes said;
        for (int i = 0; i < 3000; ++i)
            said.push_back(static_cast<std::byte>(hash64(Bytes(i % 97 + 1, std::byte(seed * i)))));
        seeds.add("panels", lengthOf(asBytes(panel)) + asBytes(panel) + said);
    }
    for (const auto& entry : std::filesystem::directory_iterator(root / "deploy/scenes"))
        if (entry.path().extension() == ".panel")
            seeds.add("panels", lengthOf(contentOf(entry.path())) + contentOf(entry.path()));
    for (const auto& entry : std::filesystem::directory_iterator(root / "deploy/scenes"))
        if (entry.path().extension() == ".tsct" && entry.file_size() < 3000)
            seeds.add("files", byte(2) + contentOf(entry.path()));

    Aspect scene;
    ChangeList list = test::bodyScene(Vec3d(0, -10, 0), Vec3d::Zero(), {{0, 0, 0, 0}, {1, 1, 0, 0}});
    replaceIds(list, [](ObjectId id) { return isPlaceholder(id) ? ObjectId(id.value - kFirstPlaceholder + 2) : id; });
    if (!scene.apply(list)) std::abort();
    for (const SceneEncoding encoding : {SceneEncoding::kText, SceneEncoding::kBinary}) {
        const Expected<std::string> saved = writeScene(scene, encoding);
        if (!saved) std::abort();
        seeds.add("files", byte(encoding == SceneEncoding::kText ? 2 : 3) +
                               std::as_bytes(std::span(saved->data(), saved->size())));
        if (encoding == SceneEncoding::kBinary) {
            const ByteSpan bytes = std::as_bytes(std::span(saved->data(), saved->size()));
            seeds.add("importer", byte(1) + byte(0) + lengthOf(bytes) + bytes);
        }
    }
    const std::string gltf =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[1,2,3]}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,)"
        R"("componentType":5126,"count":3,)"
        R"("type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,)"
        R"("uri":"data:application/octet-stream;base64,)"
        R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
    seeds.add("files", byte(0) + std::as_bytes(std::span(gltf.data(), gltf.size())));
    for (const auto& [kind, text] :
         {std::pair{4, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
          {5, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
          {6,
           "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
          {7,
           "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
           "endsolid\n"}})
        seeds.add("files", byte(static_cast<std::size_t>(kind)) + std::as_bytes(std::span(text, std::strlen(text))));

    Bytes records = byte(1);
    const auto record = [&](const RecordContent& content) {
        records = records + byte(content.kind) + lengthOf(content.bytes()) + content.bytes();
    };
    record(encodeStartList(list));
    record(encodeStarted({Sequence(1), scene.stateHash()}));
    std::vector<Edit> edits(1);
    edits[0].list = test::moveTo(ObjectId(2), Vec3d(1, 2, 3));
    record(encodeInputs(FrameNumber(0), true, edits, {}));
    record(encodeOutcome({FrameNumber(0), {}}));
    record(encodeClosing({1}));
    seeds.add("recordings", records);

    for (const Bytes& bytes : fuzz::trackerSeeds()) seeds.add("trackers", bytes);
    for (const bool isSnapshot : {false, true}) {
        Bytes kept = byte(1);
        const auto keep = [&](const JournalRecord& what) {
            const RecordContent content = encodeJournal(what);
            kept = kept + byte(content.kind) + lengthOf(content.bytes()) + content.bytes();
        };
        const auto whole = std::make_shared<const ChangeList>(snapshot(scene));
        const auto move = std::make_shared<const ChangeList>(test::moveTo(ObjectId(2), Vec3d(1, 2, 3)));
        for (const Blob& blob : blobsOf(*whole)) keep(journal::Array{blob});
        keep(journal::View{{.byHand = View(), .standing = {}, .users = {}}});
        if (isSnapshot) {
            using Place = EditHistory::Kept::Place;
            keep(journal::Step{.kept = {.lists = {move}, .gesture = {1, 2}}});
            for (const Place place : {Place::kArriving, Place::kRest, Place::kDone})
                keep(journal::Step{.kept = {.place = place, .lists = {move}, .apart = true, .made = {20, 5}}});
            keep(journal::State{.begun = true,
                                .nextFrame = FrameNumber(7),
                                .sequence = Sequence(3),
                                .stateHash = scene.stateHash(),
                                .list = whole,
                                .display = {}});
        } else {
            keep(
                journal::Frame{.start = true,
                               .frame = {},
                               .sequence = Sequence(1),
                               .stateHash = scene.stateHash(),
                               .list = whole,
                               .history = {{.kind = HistoryEvent::Kind::kEdited, .inverse = move, .gesture = {1, 2}},
                                           {.kind = HistoryEvent::Kind::kUndone, .inverse = move, .gesture = {}},
                                           {.kind = HistoryEvent::Kind::kPartArrived, .inverse = move, .made = {20, 5}},
                                           {.kind = HistoryEvent::Kind::kPartsTakenAway, .inverse = nullptr}},
                               .display = std::vector<ObjectId>{ObjectId(1)}});
            keep(journal::Frames{FrameNumber(64)});
        }
        seeds.add("journals", kept);
    }
}

}  // namespace
}  // namespace tessera

int main(int count, char** words) {
    if (count != 2) {
        std::fprintf(stderr, "fuzz_seeds FOLDER\n");
        return 2;
    }
    tessera::write(tessera::Seeds(words[1]));
    return 0;
}
