/// What there is of memory, and what happens where GL has no more of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/draw/store/MeshBuffers.h"
#include "client/draw/surface/GlMemory.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr std::size_t kGiB = std::size_t{1} << 30;

/// Files as Linux has them, below a folder of their own.
class Files {
public:
    Files() {
        std::string name = (std::filesystem::temp_directory_path() / "tessera-memory-XXXXXX").string();
        root = ::mkdtemp(name.data());
    }
    ~Files() { std::filesystem::remove_all(root); }
    void write(const std::string& file, const std::string& text) const {
        std::filesystem::create_directories((root / file).parent_path());
        std::ofstream(root / file) << text;
    }
    std::filesystem::path root;
};

TEST(GlMemory, IsWhatTheMachineAndItsControlGroupsLeave) {
    const Files files;
    EXPECT_FALSE(freeOnMachine(files.root));
    files.write("proc/meminfo", "MemTotal:       24684092 kB\nMemFree:  1000 kB\nMemAvailable:   2000000 kB\n");
    EXPECT_EQ(freeOnMachine(files.root), 2'000'000u * 1024);
    files.write("proc/self/cgroup", "4:memory:/old\n0::/walls/left\n");
    files.write("sys/fs/cgroup/walls/left/memory.max", "max\n");
    files.write("sys/fs/cgroup/walls/left/memory.current", "5000\n");
    EXPECT_EQ(freeOnMachine(files.root), 2'000'000u * 1024) << "no limit";
    files.write("sys/fs/cgroup/walls/memory.max", "1000000\n");
    files.write("sys/fs/cgroup/walls/memory.current", "300000\n");
    EXPECT_EQ(freeOnMachine(files.root), 700'000u) << "that of whom it is part of";
    files.write("sys/fs/cgroup/walls/memory.stat", "anon 100000\ninactive_file 200000\nactive_file 7\n");
    EXPECT_EQ(freeOnMachine(files.root), 900'000u) << "files that were read are as good as free";
    files.write("sys/fs/cgroup/walls/left/memory.max", "4000\n");
    EXPECT_EQ(freeOnMachine(files.root), 0u);
    // In a container the group is the outermost that it sees.
    files.write("proc/self/cgroup", "0::/\n");
    files.write("sys/fs/cgroup/memory.max", "80000\n");
    files.write("sys/fs/cgroup/memory.current", "30000\n");
    EXPECT_EQ(freeOnMachine(files.root), 50'000u);
}

// Each takes a quarter of what is free and of what it has taken: all together never more than there is.
TEST(GlMemory, HostsOfOneMachineShareIt) {
    for (const std::size_t machine : {4 * kGiB, 16 * kGiB, 256 * kGiB})
        for (const std::size_t hosts : {1u, 4u, 9u}) {
            SCOPED_TRACE(machine / kGiB);
            SCOPED_TRACE(hosts);
            std::vector<std::size_t> taken(hosts, 0);
            std::size_t sum = 0;
            for (int round = 0; round < 20; ++round)
                for (std::size_t& own : taken) {
                    const GlMemory memory = memoryOfProcessor(machine - sum, own);
                    EXPECT_LE(memory.limit, kMostOnProcessor);
                    EXPECT_EQ(memory.there, machine - sum + own);
                    EXPECT_TRUE(memory.hard);
                    sum += memory.limit - own;
                    own = memory.limit;
                }
            EXPECT_LE(sum, machine / 8 * 7);
            EXPECT_GE(sum, std::min(machine / 5, hosts * kMostOnProcessor));
        }
    EXPECT_EQ(memoryOfProcessor(0, 0).limit, kLeastGlMemory);
    EXPECT_FALSE(memoryOfProcessor(std::nullopt, 0).hard) << "nobody knows what is there";
}

using Mesh = std::shared_ptr<const DrawMesh>;
std::vector<Mesh> spheres(int from, int count, int segments = 24) {
    std::vector<Mesh> meshes;
    for (int i = from; i < from + count; ++i) {
        TestScene scene;
        const ObjectId ball = scene.add(makeSphere(0.2 + 0.001 * i, segments));
        meshes.push_back(drawMeshOf(drawableOf(scene.take(), ball)));
    }
    return meshes;
}

/// So many balls in one list.
Aspect rowOf(int from, int count) {
    TestScene scene;
    scene.setDark();
    const ObjectId look = scene.add(unlit(Vec3f::Constant(0.5f)));
    for (int i = from; i < from + count; ++i)
        scene.place(scene.add(makeSphere(0.1 + 0.001 * i, 24), look), {0.2 * (i % 10) - 1, 0.2 * (i / 10) - 0.5, 0});
    return scene.take();
}

class MemoryLimitTest : public RendererTest {};

// One buffer goes as far as GL, or its numbers, count: what the draw does not need makes room, and what has none is
// left out and counted. Nothing ends.
TEST_F(MemoryLimitTest, WhatABufferHasNoRoomForIsLeftOut) {
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    const Aspect first = rowOf(0, 10), second = rowOf(10, 10), both = rowOf(0, 20);
    const Picture ofFirst = draw(first, camera), ofSecond = draw(second, camera), ofBoth = draw(both, camera);
    // Room for ten of them in the largest buffer, and no more than one beside.
    restart({.samples = 1});
    (void)draw(first, camera);
    const std::size_t ten = renderer_->residentBytes();
    restart({.samples = 1, .mostBufferBytes = ten / 4 * 3});
    for (int round = 0; round < 3; ++round) {
        SCOPED_TRACE(round);
        EXPECT_EQ(draw(first, camera), ofFirst);
        EXPECT_EQ(renderer_->lastCounts().skipped, 0u);
        EXPECT_EQ(draw(second, camera), ofSecond) << "the others have given way";
        EXPECT_EQ(renderer_->lastCounts().skipped, 0u);
        EXPECT_NE(draw(both, camera), ofBoth);
        EXPECT_EQ(renderer_->lastCounts().skipped, 10u);
    }
}

/// GL with little memory: larger buffers than these are refused.
struct Refusing : GlFunctions {
    explicit Refusing(const GlFunctions& functions) : GlFunctions(functions) {
        real = NamedBufferData;
        NamedBufferData = [](GLuint buffer, GLsizeiptr size, const void* data, GLenum usage) {
            asked = std::max(asked, static_cast<std::size_t>(size) + (watched ? watched->allocatedBytes() : 0));
            real(buffer, static_cast<std::size_t>(size) > most ? -1 : size, data, usage);
        };
    }
    static inline PFNGLNAMEDBUFFERDATAPROC real = nullptr;
    static inline std::size_t most = 0, asked = 0;  ///< asked: with all that was there
    static inline const MeshBuffers* watched = nullptr;
};

class MeshBuffersTest : public testing::Test {
protected:
    void SetUp() override {
        auto surface = makeSurface("osmesa");
        ASSERT_TRUE(surface) << surface.error().message;
        surface_ = std::move(*surface);
        ASSERT_TRUE(surface_->makeCurrent());
        gl_ = GlState(Refusing(GlFunctions::load(*surface_).value()));
        Refusing::most = std::numeric_limits<std::size_t>::max() / 2;
        Refusing::asked = 0;
        gl_.CreateVertexArrays(1, &array_);
        meshes_.emplace(gl_, clock_, array_);
        Refusing::watched = &*meshes_;
        begin();
    }
    void TearDown() override {
        Refusing::watched = nullptr;
        meshes_.reset();
        gl_.DeleteVertexArrays(1, &array_);
    }
    void begin() {
        clock_.beginDraw();
        meshes_->beginDraw();
    }
    bool found(const Mesh& mesh) { return meshes_->find(*mesh) != nullptr; }

    std::unique_ptr<Surface> surface_;
    GlState gl_;
    GLuint array_ = 0;
    UseClock clock_;
    std::optional<MeshBuffers> meshes_;
};

TEST_F(MeshBuffersTest, WhereGlHasNoMemoryTheOldBufferStays) {
    const std::vector<Mesh> small = spheres(0, 2), large = spheres(2, 1, 200);
    EXPECT_TRUE(found(small[0]));
    const GLuint indices = meshes_->indexBuffer();
    const std::uint64_t uploaded = meshes_->uploadedBytes();
    Refusing::most = 500'000;
    EXPECT_FALSE(found(large[0]));
    EXPECT_TRUE(gl_.check("that")) << "it is no error";
    EXPECT_EQ(meshes_->indexBuffer(), indices);
    EXPECT_TRUE(found(small[0]));
    EXPECT_EQ(meshes_->uploadedBytes(), uploaded);
    EXPECT_TRUE(found(small[1]));
    // What was wrong before it is said all the same.
    gl_.DepthFunc(GL_BACK);
    begin();
    EXPECT_FALSE(found(large[0]));
    EXPECT_FALSE(gl_.check("that"));
    EXPECT_TRUE(gl_.check("that")) << "once";
    Refusing::most = std::numeric_limits<std::size_t>::max() / 2;
    begin();
    EXPECT_TRUE(found(large[0])) << "once there is memory again";
}

// A buffer is there twice while it grows: old and new stay within what there is.
TEST_F(MeshBuffersTest, OldAndNewFitIntoWhatThereIs) {
    const std::vector<Mesh> many = spheres(0, 60);
    for (const Mesh& mesh : many) EXPECT_TRUE(found(mesh));
    const std::size_t all = meshes_->residentBytes();
    EXPECT_GT(Refusing::asked, all / 4 * 5);
    meshes_.emplace(gl_, clock_, array_);
    Refusing::asked = 0;
    const std::size_t atOnce = all;
    meshes_->setBudget({.atOnce = atOnce, .mostAtOnce = atOnce});
    begin();
    std::size_t there = 0;
    for (const Mesh& mesh : many) there += found(mesh);
    EXPECT_LE(Refusing::asked, atOnce);
    EXPECT_GT(there, 20u);
    EXPECT_LT(there, 60u);
    // Where that is no end, growing goes on as far as it must.
    meshes_->setBudget({.atOnce = atOnce});
    begin();
    for (const Mesh& mesh : many) EXPECT_TRUE(found(mesh));
    EXPECT_TRUE(gl_.check("that"));
}

}  // namespace
}  // namespace tessera
