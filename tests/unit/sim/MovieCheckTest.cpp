/// No two Movies write one Image, whatever has come and gone.
#include <gtest/gtest.h>

#include "common/cores/Movie.h"
#include "server/sim/commit/Committer.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

class MovieCheck : public testing::Test {
protected:
    void SetUp() override {
        ChangeListBuilder list;
        list.create(ObjectId(kFirstPlaceholder), typeOf<Image>());
        list.create(ObjectId(kFirstPlaceholder + 1), typeOf<Image>());
        const Expected<Committer::Applied> made = committer.apply(list.take());
        ASSERT_TRUE(made);
        image = made->ids[0].second;
        other = made->ids[1].second;
    }
    static ChangeList movieOf(ObjectId shown) {
        ChangeListBuilder list;
        const ObjectId movie(kFirstPlaceholder);
        list.create(movie, typeOf<Movie>());
        list.set(movie, typeOf<Movie>(), fieldId<&Movie::image>, toValue(shown));
        return list.take();
    }
    static ChangeList turned(ObjectId movie, ObjectId shown) {
        ChangeListBuilder list;
        list.set(movie, typeOf<Movie>(), fieldId<&Movie::image>, toValue(shown));
        return list.take();
    }
    static std::string refusal(Committer& by, ChangeList list) {
        const Expected<Committer::Applied> applied = by.apply(std::move(list));
        return applied ? "" : applied.error().message;
    }
    Committer committer;
    ObjectId image, other;
};

TEST_F(MovieCheck, AnImageHasOneWriter) {
    const Expected<Committer::Applied> first = committer.apply(movieOf(image));
    ASSERT_TRUE(first);
    const ObjectId movie = first->ids[0].second;
    EXPECT_WORDS(refusal(committer, movieOf(image)));
    const Expected<Committer::Applied> second = committer.apply(movieOf(other));
    ASSERT_TRUE(second);
    EXPECT_WORDS(refusal(committer, turned(movie, other)));
    EXPECT_EQ(refusal(committer, turned(movie, image)), "") << "its own";
}

TEST_F(MovieCheck, WhoHasGoneWritesNothingAndWhoComesBackDoes) {
    const Expected<Committer::Applied> first = committer.apply(movieOf(image));
    ASSERT_TRUE(first);
    ChangeListBuilder removal;
    removal.destroy(first->ids[0].second);
    const Expected<Committer::Applied> gone = committer.apply(removal.take(), Committer::Inverse::kMade);
    ASSERT_TRUE(gone);
    const Expected<Committer::Applied> next = committer.apply(movieOf(image), Committer::Inverse::kMade);
    ASSERT_TRUE(next) << "nobody writes it any more";
    (void)committer.closeFrame();
    ASSERT_TRUE(committer.applyInverse(std::make_shared<const ChangeList>(next->inverse)));
    ASSERT_TRUE(committer.applyInverse(std::make_shared<const ChangeList>(gone->inverse)));
    EXPECT_WORDS(refusal(committer, movieOf(image)));
}

TEST_F(MovieCheck, OfASceneThatIsGoneOnWithToo) {
    ASSERT_TRUE(committer.apply(movieOf(image)));
    Aspect copy;
    ASSERT_TRUE(copy.apply(snapshot(committer.scene())));
    Committer later;
    later.goOnFrom(std::move(copy), Sequence(7));
    EXPECT_WORDS(refusal(later, movieOf(image)));
    EXPECT_EQ(refusal(later, movieOf(other)), "");
}

}  // namespace
}  // namespace tessera
