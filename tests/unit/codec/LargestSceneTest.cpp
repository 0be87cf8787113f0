// A scene of as many objects as one may have can be sent to those who join: bounds of scene, list and blob agree.
#include <gtest/gtest.h>

#include "common/base/Limits.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

TEST(LargestScene, NoTypeHasMoreFieldsThanTheBoundOfAListCountsOn) {
    for (const TypeInfo& type : allTypes()) EXPECT_LE(type.fields.size(), limits::kMaxFieldsOfType) << type.name;
}

/// The one test of this size: about 2 GB and some seconds. Every number is different, so nothing is left away.
TEST(LargestScene, IsSnapshotEncodedDecodedAndApplied) {
    Bytes bytes;
    StateHash hash;
    {
        Aspect scene;
        {
            ChangeListBuilder list;
            for (std::uint64_t id = 2; id <= limits::kMaxObjects; ++id) {
                const ObjectId object(id);
                const auto number = static_cast<double>(id);
                list.create(object, typeOf<Transform>());
                setField<&Transform::translation>(list, object, Vec3d(number, 1, 2));
                setField<&Transform::scale>(list, object, Vec3d(number, 1, 1));
            }
            const Expected<void> applied = scene.apply(list.take());
            ASSERT_TRUE(applied) << applied.error().message;
        }
        ASSERT_EQ(scene.objectCount(), limits::kMaxObjects);
        ChangeListBuilder oneMore;
        oneMore.create(ObjectId(limits::kMaxObjects + 1), typeOf<Transform>());
        EXPECT_FALSE(scene.apply(oneMore.take())) << "there are no larger ones";
        hash = scene.stateHash();
        bytes = encodeChangeList(snapshot(scene));
    }
    // As it lies in the blob that is fetched.
    const Blob content = encodeSnapshot({1_seq, hash, std::move(bytes), {}});
    ASSERT_LE(content.sizeBytes(), limits::kMaxBlobBytes);
    const Expected<CommittedListPtr> whole = decodeSnapshot(content);
    ASSERT_TRUE(whole) << whole.error().message;
    Expected<ChangeList> list = decodeChangeList((*whole)->encoded, BlobStore());
    ASSERT_TRUE(list) << list.error().message;
    Aspect replica;
    const Expected<void> applied = replica.apply(*list);
    ASSERT_TRUE(applied) << applied.error().message;
    EXPECT_EQ(replica.stateHash(), hash);
    std::printf("%zu objects: %zu MiB\n", replica.objectCount(), static_cast<std::size_t>(content.sizeBytes() >> 20));
}

}  // namespace
}  // namespace tessera
