#include <fmt/format.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/render/order/RenderAction.h"
#include "common/codec/ChangeCodec.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/Simulation.h"
#include "tests/bench/PlainCopy.h"
#include "tests/bench/SceneMaker.h"
#include "tests/bench/SceneRows.h"
#include "tests/bench/SceneSide.h"
#include "tests/bench/SceneTreeOurs.h"

namespace tessera::bench {
namespace {

template <typename Work>
double secondsOf(Work&& work) {
    const double start = threadSeconds();
    work();
    return threadSeconds() - start;
}

/// The cores of a tree's nodes, ascending.
std::vector<ObjectId> transformsOf(const Aspect& scene) {
    std::vector<ObjectId> found;
    for (const ObjectId id : scene.ids())
        if (scene.get<Transform>(id)) found.push_back(id);
    return found;
}

/// One field of each of them.
ChangeList shift(std::span<const ObjectId> transforms, double by) {
    ChangeListBuilder list;
    for (const ObjectId id : transforms)
        list.set(id, typeOf<Transform>(), fieldId<&Transform::translation>,
                 toValue(Vec3d(by, 1e-3 * static_cast<double>(id.value), 0)));
    return list.take();
}

/// All three fields, as `bench_change` moves them.
ChangeList move(std::uint64_t count, double by) {
    ChangeListBuilder list;
    for (std::uint64_t i = 0; i < count; ++i) {
        const ObjectId id{2 + i};
        const double t = 0.001 * static_cast<double>(i) + by;
        list.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(t, -t, 0.5)));
        list.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(Quatd(1, t, 0, 0)));
        list.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1)));
    }
    return list.take();
}

/// Work and a copy of the list it is about, in turns.
class Alone {
public:
    Alone(SceneTable& table, int repeats) : table_(table), repeats_(repeats) {}
    /// `before` is not timed. `work` returns seconds.
    void row(const std::string& operation, const ChangeList& about, const std::function<double()>& work,
             double atMost = 0, double aim = 0) {
        PlainCopy copy(about);
        std::vector<double> ours, theirs;
        for (int i = 0; i <= repeats_; ++i) {
            const double our = work();
            const double their = secondsOf([&] { copy(); });
            if (i == 0) continue;
            ours.push_back(our);
            theirs.push_back(their);
        }
        table_.add({.operation = operation,
                    .peer = "memcpy",
                    .ours = medianOf(std::move(ours), 1e3),
                    .theirs = medianOf(std::move(theirs), 1e3),
                    .unit = "ms",
                    .atMost = atMost,
                    .aim = aim,
                    .remark = fmt::format("{:.0f} MB", 1e-6 * static_cast<double>(copy.sizeBytes()))});
    }

private:
    SceneTable& table_;
    int repeats_;
};

void millionRows(SceneTable& table, const SceneOptions& options) {
    table.begin(fmt::format("{} nodes alone", options.many));
    Alone alone(table, options.quick ? 1 : 7);
    Aspect scene;
    must(scene.apply(treeList(treePlaces(options.many))).has_value());
    const ChangeList whole = snapshot(scene);
    const Bytes encoded = encodeChangeList(whole);
    const BlobStore blobs;
    alone.row("snapshot", whole, [&] { return secondsOf([&] { must(!snapshot(scene).empty()); }); });
    alone.row("encode the snapshot", whole, [&] { return secondsOf([&] { must(!encodeChangeList(whole).empty()); }); });
    alone.row("decode it", whole,
              [&] { return secondsOf([&] { must(decodeChangeList(encoded, blobs).has_value()); }); });
    alone.row("apply it to an empty scene, hash included", whole, [&] {
        Aspect empty;
        const double taken = secondsOf([&] { must(empty.apply(whole).has_value()); });
        if (empty.stateHash() != scene.stateHash()) table.complain("the state hash after decoding a snapshot");
        return taken;
    });
    {
        ChangeList back;
        Aspect other;
        alone.row("apply it with its inverse", whole, [&] {
            other = Aspect();
            return secondsOf([&] { back = other.applyWithInverse(whole).value(); });
        });
        alone.row("undo it: the inverse takes all out", whole, [&] {
            if (other.objectCount() < options.many) must(other.apply(whole).has_value());
            return secondsOf([&] { must(other.apply(back).has_value()); });
        });
        if (other.objectCount() != 1) table.complain("something is left after undo");
    }
    const std::vector<ObjectId> transforms = transformsOf(scene);
    const ChangeList shifts[] = {shift(transforms, 1), shift(transforms, 2)};
    std::size_t turn = 0;
    alone.row("one field of each Transform: all hashed anew", shifts[0],
              [&] { return secondsOf([&] { must(scene.apply(shifts[turn++ & 1]).has_value()); }); });
    ChangeList back;
    alone.row("the same with its inverse", shifts[0],
              [&] { return secondsOf([&] { back = scene.applyWithInverse(shifts[turn++ & 1]).value(); }); });
    alone.row("undo it", shifts[0], [&] {
        back = scene.applyWithInverse(shifts[turn++ & 1]).value();
        return secondsOf([&] { must(scene.apply(back).has_value()); });
    });
}

void applyRow(SceneTable& table, const SceneOptions& options) {
    const std::uint64_t count = 100'000;
    table.begin(fmt::format("{} transforms", count));
    Aspect scene;
    ChangeListBuilder creations;
    for (std::uint64_t i = 0; i < count; ++i) creations.create(ObjectId(2 + i), typeOf<Transform>());
    must(scene.apply(creations.take()).has_value());
    const ChangeList moves[] = {move(count, 1), move(count, 2)};
    std::size_t turn = 0;
    Alone alone(table, options.quick ? 1 : 31);
    alone.row(
        "apply", moves[0], [&] { return secondsOf([&] { must(scene.apply(moves[turn++ & 1]).has_value()); }); }, 4,
        2.5);
    alone.row("apply with inverse", moves[0],
              [&] { return secondsOf([&] { must(scene.applyWithInverse(moves[turn++ & 1]).has_value()); }); });
}

/// `count` objects of a type as a scene holds them: nodes in a tree with ten below each, everything else by itself.
ChangeList manyOf(const TypeInfo& type, std::uint64_t count) {
    ChangeListBuilder list;
    for (std::uint64_t i = 0; i < count; ++i) {
        const ObjectId id{2 + i};
        list.create(id, type.type);
        if (type.type == typeOf<Node>()) list.place(id, i == 0 ? kRootNode : ObjectId{2 + parentOf(i)});
    }
    return list.take();
}

void byteRows(SceneTable& table) {
    const std::uint64_t count = 100'000;
    table.begin(fmt::format("bytes per object in an Aspect, {} of a type, as malloc counts", count));
    for (const TypeInfo& type : allTypes()) {
        const ChangeList list = manyOf(type, count);
        const double before = allocatedBytes();
        Aspect scene;
        must(scene.apply(list).has_value());
        const double bytes = (allocatedBytes() - before) / static_cast<double>(count);
        table.add({.operation = std::string(type.name),
                   .peer = "-",
                   .ours = {bytes, 0, 1},
                   .theirs = {},
                   .unit = "bytes",
                   .remark = type.type == typeOf<Node>()
                                 ? "without a name; its place among its parent's children included"
                                 : ""});
    }
}

/// What a node costs with all that is derived from it, in a scene where half of the nodes are Transforms and half
/// Geometry.
void derivedRows(SceneTable& table) {
    const std::uint64_t count = 100'000;
    table.begin(fmt::format("bytes per node of a scene of {}, sixteen meshes shared, cores included", count));
    const auto row = [&](const char* what, double bytes, std::uint64_t nodes) {
        table.add({.operation = what,
                   .peer = "-",
                   .ours = {bytes / static_cast<double>(nodes), 0, 1},
                   .theirs = {},
                   .unit = "bytes"});
    };
    CommittedFrame loaded;
    std::uint64_t nodes = 0;
    double withServer = 0;
    {
        std::vector<ChangeList> lists;
        lists.push_back(makeScene({.shape = SceneShape::kBushy, .size = count}));
        Simulation simulation;
        loaded = simulation.load(std::move(lists)).value();
        (void)simulation.step(true, {});
        for (const ObjectId id : simulation.scene().ids()) nodes += simulation.scene().get<Node>(id) ? 1 : 0;
        withServer = allocatedBytes();
    }
    // The list that was sent is not what the scene costs, and is still there now.
    row("server: Simulation", withServer - allocatedBytes(), nodes);
    const double before = allocatedBytes();
    Aspect replica;
    must(replica.apply(*loaded.list).has_value());
    row("host: Aspect", allocatedBytes() - before, nodes);
    RenderScene render;
    render.update(replica, nullptr);
    row("host: Aspect and RenderScene", allocatedBytes() - before, nodes);
}

}  // namespace

void aloneRows(SceneTable& table, const SceneOptions& options) {
    millionRows(table, options);
    applyRow(table, options);
    byteRows(table);
    derivedRows(table);
}

}  // namespace tessera::bench
