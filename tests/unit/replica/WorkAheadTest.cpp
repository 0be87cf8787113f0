// What a host does ahead of need, and when it does nothing.

#include "client/replica/PartSharing.h"
#include "tests/unit/replica/RenderHostFixture.h"

namespace tessera {
namespace {

TEST_F(RenderHostTest, WorksAheadUntilNothingIsLeftAndShowsTheSame) {
    start();
    EXPECT_FALSE(host_->workAhead(afterFlips())) << "nothing is drawn yet";
    Aspect scene = makeMuchToUpload();
    ASSERT_TRUE(applied(scene));
    (void)frame(0_frame);
    (void)frame(1_frame);  // at rest, where programs may take long
    int slices = 0;
    while (host_->workAhead(afterFlips()) && slices < 1000) ++slices;
    EXPECT_GT(slices, 3);
    EXPECT_LT(slices, 1000);
    const TileStats stats = frame(2_frame);
    EXPECT_EQ(stats.drawMs, 0) << "the picture before is still right";
    EXPECT_FALSE(host_->workAhead(afterFlips()));
}

/// What computes between Ready and Swap keeps those who flip here waiting (of four hosts without privileges on two
/// processors: 6 to 12 ms).
TEST_F(RenderHostTest, DoesNothingAheadUntilAllHaveFlipped) {
    start();
    Aspect scene = makeMuchToUpload();
    ASSERT_TRUE(applied(scene));
    View view;
    for (const FrameNumber number : {0_frame, 1_frame, 2_frame}) {
        view.position.x() += 0.01;
        EXPECT_TRUE(performOrAgain(work::Draw{beginOf(number, {}, view)}));
        EXPECT_FALSE(endsAhead(afterFlips())) << "Swap is to come, whenever that is";
        EXPECT_TRUE(performOrAgain(work::Shown{number}));
        EXPECT_FALSE(endsAhead(clockNow())) << "others flip now";
    }
    (void)frame(3_frame, {}, view);
    (void)frame(4_frame, {}, view);
    EXPECT_TRUE(endsAhead(afterFlips()));
}

/// Frames every 0.3 ms, each the one before once more: of 2 ms without a flip there is never one.
TEST_F(RenderHostTest, ThatStandsStillWithoutAPauseWorksAheadAllTheSame) {
    start();
    Aspect scene = makeMuchToUpload(10);
    ASSERT_TRUE(applied(scene));
    bool ended = false;
    const TimePoint begin = clockNow();
    for (std::uint64_t number = 0; !ended && clockNow() < begin + std::chrono::seconds(10); ++number) {
        (void)frame(FrameNumber(number));
        ended = !host_->workAhead(clockNow());
    }
    EXPECT_TRUE(ended);
    EXPECT_GE(clockNow() - begin, std::chrono::milliseconds(300)) << "a slice in 100 ms";
}

/// Frames that are all drawn, one after the other: what will be needed is brought there between them.
TEST_F(RenderHostTest, ThatDrawsWithoutAPauseUploadsAllTheSame) {
    const auto slicesLeftAfter = [&](std::chrono::milliseconds drawing) {
        start();
        Aspect scene = makeMuchToUpload(40);
        EXPECT_TRUE(applied(scene));
        View view;
        std::uint64_t number = 0;
        for (const TimePoint end = clockNow() + drawing; number == 0 || clockNow() < end; ++number) {
            view.position.x() += 1e-4;
            (void)frame(FrameNumber(number), {}, view);
        }
        (void)frame(FrameNumber(number), {}, view);
        int slices = 0;
        while (host_->workAhead(afterFlips()) && slices < 1000) ++slices;
        return slices;
    };
    const int all = slicesLeftAfter(std::chrono::milliseconds(0));
    EXPECT_LE(slicesLeftAfter(std::chrono::seconds(2)), all - 5) << "programs are left, and nothing that is uploaded";
}

/// What is made ahead is a person's program in other light, which this host refuses: from then on it is drawn as what
/// is wrong, also where nothing else happens. `onSquare` is a function of ours, where surroundings have a picture.
TEST_F(RenderHostTest, DrawsAnewOnceAProgramIsRefusedAhead) {
    start();
    test::TestScene made;
    SurfaceProgram program;
    program.verdict = SurfaceProgram::kGood;
    program.surface =
        "vec2 onSquare(vec3 d) { return d.xy; }\n"
        "void surface(inout Surface s) { s.base.rg = onSquare(vec3(uv, 0.0)); }";
    Material material{.baseColor = {0, 0, 1, 0.5f}, .alphaMode = Material::kBlend};
    material.program = made.add(program);
    made.place(made.add(test::makeSheet(1, 1), made.add(material)), {-0.6, 1.5, -1});
    Aspect scene = made.take();
    ASSERT_TRUE(applied(scene));
    EXPECT_GT(frame(0_frame).drawMs, 0);
    EXPECT_EQ(frame(1_frame).drawMs, 0);
    static_cast<void>(endsAhead(afterFlips()));  // what is refused ends its rest
    EXPECT_GT(frame(2_frame).drawMs, 0);
    EXPECT_EQ(frame(3_frame).drawMs, 0);
    EXPECT_TRUE(endsAhead(afterFlips()));
}

TEST_F(RenderHostTest, AloneOnItsMachineWorksAheadBeforeSwapToo) {
    Board board = Board::create().value();
    PartSharing sharing({}, board, log_);
    start({.sharing = &sharing});
    Aspect scene = makeMuchToUpload();
    ASSERT_TRUE(applied(scene));
    (void)frame(0_frame);
    (void)frame(1_frame);
    EXPECT_TRUE(performOrAgain(work::Draw{beginOf(2_frame)}));
    EXPECT_TRUE(endsAhead(clockNow()));
}

/// A host whose probe has found that programs take long, as llvmpipe does without a cache.
TEST_F(RenderHostTest, InMotionMakesNoProgramThatTakesLong) {
    start({.shortProgram = std::chrono::nanoseconds(0)});
    Aspect scene = makeMuchToUpload();
    ASSERT_TRUE(applied(scene));
    View view;
    for (std::uint64_t number = 0; number < 3; ++number) {
        view.position.x() += 0.01;
        (void)frame(FrameNumber(number), {}, view);
        for (int slice = 0; slice < 100; ++slice) EXPECT_TRUE(host_->workAhead(afterFlips())) << "programs are left";
    }
    (void)frame(3_frame, {}, view);
    EXPECT_TRUE(endsAhead(afterFlips())) << "at rest";
}

}  // namespace
}  // namespace tessera
