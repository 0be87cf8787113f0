/// Encoded lists, one after the other, on a small scene: each is refused and leaves no trace, or applied and can be
/// taken back.
#include "common/codec/ChangeCodec.h"
#include "common/scene/Aspect.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

/// A bit of everything that refers to something else.
ChangeList start() {
    ChangeListBuilder list;
    std::uint64_t next = 2;
    const auto node = [&](ObjectId parent, ObjectType core) {
        const ObjectId id{next++}, held{next++};
        list.create(id, typeOf<Node>());
        list.create(held, core);
        setField<&Node::core>(list, id, held);
        list.place(id, parent);
        return id;
    };
    const ObjectId hall = node(kRootNode, typeOf<Transform>());
    const ObjectId crane = node(hall, typeOf<Transform>());
    (void)node(crane, typeOf<Geometry>());
    (void)node(crane, typeOf<Switch>());
    (void)node(hall, typeOf<Motion>());
    (void)node(kRootNode, typeOf<Camera>());
    return list.take();
}

void run(FuzzInput in) {
    Aspect aspect({.maxObjects = 1000, .maxChildren = 20, .maxDepth = 8});
    must(aspect.apply(start()).has_value(), "the scene to begin with is sound");
    while (!in.empty()) {
        const ByteSpan bytes = in.bytes(in.number<std::uint16_t>());
        const auto list = decodeChangeList(bytes, BlobStore(), AbsentBlobs::kKeepAbsent);
        if (!list) continue;
        const StateHash before = aspect.stateHash();
        const auto back = aspect.applyWithInverse(*list);
        if (!back) {
            must(aspect.stateHash() == before, "a refused list leaves no trace");
            continue;
        }
        const StateHash after = aspect.stateHash();
        Aspect copy({.maxObjects = 1000, .maxChildren = 20, .maxDepth = 8});
        must(copy.apply(snapshot(aspect)).has_value() && copy.stateHash() == after, "a snapshot makes the same scene");
        const auto forward = aspect.applyWithInverse(*back);
        must(forward.has_value() && aspect.stateHash() == before, "what was applied can be taken back");
        must(aspect.apply(*forward).has_value() && aspect.stateHash() == after, "and done again");
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
