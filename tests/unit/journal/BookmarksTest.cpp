// Bookmarks as a journal's records have them.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/journal/JournalFormat.h"

namespace tessera {
namespace {

Bytes bytesOfView(const RecordContent& content) {
    const ByteSpan bytes = content.bytes();
    return {bytes.begin(), bytes.end()};
}

TEST(Bookmarks, AreKeptWithTheirNumbers) {
    std::mt19937 random(4);
    for (int round = 0; round < 300; ++round) {
        ViewState state;
        if (random() % 2 == 0) state.byHand = View();
        for (std::size_t i = 0; i < state.bookmarks.size(); ++i) {
            if (random() % 2 == 0) continue;
            state.bookmarks[i].emplace();
            state.bookmarks[i]->position = Vec3d(static_cast<double>(i), static_cast<double>(random() % 100), -3);
        }
        const RecordContent content = encodeJournal(journal::View{state});
        const Expected<JournalRecord> back = decodeJournal(content.kind, bytesOfView(content), BlobStore());
        ASSERT_TRUE(back) << back.error().message;
        const ViewState& there = std::get<journal::View>(*back).state;
        EXPECT_EQ(there.byHand.has_value(), state.byHand.has_value());
        for (std::size_t i = 0; i < state.bookmarks.size(); ++i) {
            ASSERT_EQ(there.bookmarks[i].has_value(), state.bookmarks[i].has_value());
            if (there.bookmarks[i]) {
                EXPECT_EQ(there.bookmarks[i]->position, state.bookmarks[i]->position);
            }
        }
        // Cut short anywhere it is refused, and nothing else happens.
        Bytes cut = bytesOfView(content);
        cut.resize(random() % cut.size());
        EXPECT_FALSE(decodeJournal(content.kind, Bytes(cut), BlobStore()));
    }
}

/// Undo joins and cuts the lists of steps before any scene looks at them.
TEST(JournalSteps, OfColumnsThatAreNotTheirFieldsAreRefused) {
    EditHistory::Kept kept;
    FieldColumn misfit =
        FieldColumn::ofShape(typeOf<Transform>(), fieldId<&Transform::translation>, FieldKind::kInt, 1);
    misfit.append(ObjectId(5), std::int64_t{7});
    auto list = std::make_shared<ChangeList>();
    list->columns.push_back(misfit);
    kept.lists = {list};
    const RecordContent content = encodeJournal(journal::Step{kept});
    const Expected<JournalRecord> back = decodeJournal(content.kind, bytesOfView(content), BlobStore());
    ASSERT_FALSE(back);
    EXPECT_EQ(back.error().code, ErrorCode::kBadInput);
}

}  // namespace
}  // namespace tessera
