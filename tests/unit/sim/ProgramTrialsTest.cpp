// Programs of persons are tried before anybody draws with them. The child is a script here, that says what it is told
// to; the last test has the real one.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <fstream>
#include <functional>
#include <map>

#include "common/cores/Material.h"
#include "common/cores/Movie.h"
#include "common/scene/FieldTable.h"
#include "common/scene/WrittenByServer.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/frame/Simulation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

constexpr ObjectId kProgram{2};

ChangeList creating(const SurfaceProgram& program, ObjectId id = kProgram) {
    ChangeListBuilder list;
    list.create(id, typeOf<SurfaceProgram>());
    setAllFields(list, id, Object::of(program));
    return list.take();
}
Aspect sceneOf(const SurfaceProgram& program) {
    Aspect scene;
    EXPECT_TRUE(scene.apply(creating(program)));
    return scene;
}

class ProgramTrialsTest : public testing::Test {
protected:
    std::string script(const std::string& text) {
        const std::string path = folder_ / "try";
        std::ofstream(path) << "#!/bin/sh\necho tried >> " << folder_.path() << "/log\n" << text << "\n";
        ::chmod(path.c_str(), 0755);
        return path;
    }
    int timesTried() const {
        std::ifstream log(folder_ / "log");
        int lines = 0;
        for (std::string line; std::getline(log, line);) ++lines;
        return lines;
    }
    /// What comes out of a scene with one program.
    TrialVerdict verdictBy(const std::string& text) {
        Aspect scene = sceneOf({.surface = "a text"});
        ProgramTrials trials(script(text));
        trials.update(scene, nullptr);
        const ChangeList list = trials.verdicts(scene, std::chrono::seconds(30));
        remarks_ = trials.takeRemarks();
        if (!list.empty()) EXPECT_TRUE(scene.apply(list));
        const auto& after = *scene.get<SurfaceProgram>(kProgram);
        return {after.verdict, after.problem};
    }
    test::TestFolder folder_;
    std::vector<std::string> remarks_;
};

TEST_F(ProgramTrialsTest, VerdictsAreWhatTheChildSays) {
    EXPECT_EQ(verdictBy("cat > /dev/null; printf good"), (TrialVerdict{SurfaceProgram::kGood, ""}));
    EXPECT_TRUE(remarks_.empty());
    EXPECT_EQ(verdictBy("printf 'bad surface, line 3: what?\\n\\033[31m'"),
              (TrialVerdict{SurfaceProgram::kBad, "surface, line 3: what?  [31m"}));
    ASSERT_EQ(remarks_.size(), 1u);
    EXPECT_EQ(remarks_[0], "SurfaceProgram #2: surface, line 3: what?  [31m");
    EXPECT_EQ(verdictBy("head -c 1000000 /dev/zero").verdict, SurfaceProgram::kBad);
    EXPECT_EQ(verdictBy("true").verdict, SurfaceProgram::kBad);
    EXPECT_EQ(verdictBy("printf goodbye").verdict, SurfaceProgram::kBad);
    EXPECT_EQ(verdictBy("kill -SEGV $$").problem, "the compiler crashes on it (Segmentation fault)");
    EXPECT_EQ(verdictBy("kill -XCPU $$").problem, "compiling it and drawing a small picture takes more than 2 s");
}

TEST_F(ProgramTrialsTest, WhoCannotTrySaysSoOnceAndNothingIsDrawn) {
    EXPECT_EQ(verdictBy("printf 'cannot there is no OSMesa'").verdict, SurfaceProgram::kUntried);
    ASSERT_EQ(remarks_.size(), 1u);
    EXPECT_WORDS(remarks_[0]);
    Aspect scene = sceneOf({.surface = "a text"});
    ProgramTrials none("/nowhere/tessera-try-program");
    none.update(scene, nullptr);
    EXPECT_TRUE(none.verdicts(scene, std::chrono::seconds(5)).empty());
    EXPECT_EQ(none.takeRemarks().size(), 1u);
    EXPECT_TRUE(none.verdicts(scene).empty());
    EXPECT_TRUE(none.takeRemarks().empty());
}

TEST_F(ProgramTrialsTest, TheTextArrivesWhole) {
    Aspect scene = sceneOf({.surface = std::string(4096, 's'), .vertex = "v\n\"$x\""});
    ProgramTrials trials(script("cat > " + folder_.path() + "/text; printf good"));
    trials.update(scene, nullptr);
    (void)trials.verdicts(scene, std::chrono::seconds(30));
    std::ifstream file(folder_ / "text");
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    EXPECT_EQ(text, "4096 6\n" + std::string(4096, 's') + "v\n\"$x\"");
}

TEST_F(ProgramTrialsTest, ATextIsTriedOnceForAllWhoHaveIt) {
    Aspect scene = sceneOf({.surface = "same"});
    ASSERT_TRUE(scene.apply(creating({.surface = "same"}, ObjectId(3))));
    ProgramTrials trials(script("printf good"));
    trials.update(scene, nullptr);
    EXPECT_EQ(trials.pending(), 2u);
    ASSERT_TRUE(scene.apply(trials.verdicts(scene, std::chrono::seconds(30))));
    EXPECT_EQ(scene.get<SurfaceProgram>(ObjectId(3))->verdict, SurfaceProgram::kGood);
    const ChangeList later = creating({.surface = "same"}, ObjectId(4));
    ASSERT_TRUE(scene.apply(later));
    trials.update(scene, &later);
    ASSERT_TRUE(scene.apply(trials.verdicts(scene)));
    EXPECT_EQ(scene.get<SurfaceProgram>(ObjectId(4))->verdict, SurfaceProgram::kGood);
    EXPECT_EQ(timesTried(), 1);
}

TEST_F(ProgramTrialsTest, AVerdictIsOfTheTextThatWasTried) {
    Aspect scene = sceneOf({.surface = "first"});
    ProgramTrials trials(script("sleep 0.3; grep -q first && printf good || printf 'bad second'"));
    trials.update(scene, nullptr);
    EXPECT_TRUE(trials.verdicts(scene).empty());
    ChangeListBuilder edit;
    edit.set(kProgram, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::surface>, toValue(std::string("second")));
    const ChangeList list = edit.take();
    ASSERT_TRUE(scene.apply(list));
    trials.update(scene, &list);
    while (trials.pending() > 0)
        if (const ChangeList verdicts = trials.verdicts(scene, std::chrono::seconds(1)); !verdicts.empty())
            ASSERT_TRUE(scene.apply(verdicts));
    EXPECT_EQ(scene.get<SurfaceProgram>(kProgram)->verdict, SurfaceProgram::kBad);
    EXPECT_EQ(scene.get<SurfaceProgram>(kProgram)->problem, "second");
}

TEST_F(ProgramTrialsTest, NothingIsLeftOfAChildWhenTheServerGoes) {
    Aspect scene = sceneOf({.surface = "a text"});
    const TimePoint begun = clockNow();
    {
        ProgramTrials trials(script("sleep 60"));
        trials.update(scene, nullptr);
        EXPECT_TRUE(trials.verdicts(scene).empty());
    }
    EXPECT_LT(clockNow() - begun, std::chrono::seconds(30));
}

/// An application may say what it likes: a text comes untried, in the very list that brings it.
TEST(ProgramVerdicts, NobodyButTheServerSaysThem) {
    Simulation simulation;
    const auto edit = [&](ChangeList list, bool undoable = true) {
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = std::move(list), .undoable = undoable});
        FrameResult result = simulation.step(false, std::move(edits));
        EXPECT_TRUE(result.outcomes[0].result) << result.outcomes[0].result.error().message;
        return result;
    };
    const FrameResult made = edit(creating({.surface = "mine", .verdict = SurfaceProgram::kGood, .problem = "none"},
                                           ObjectId(kFirstPlaceholder)));
    const ObjectId id = made.outcomes[0].result->ids.at(0).second;
    const auto program = [&]() -> const SurfaceProgram& { return *simulation.scene().get<SurfaceProgram>(id); };
    EXPECT_EQ(program().verdict, SurfaceProgram::kUntried);
    EXPECT_EQ(program().problem, "");
    const auto say = [&](FieldId field, const FieldValue& value, bool undoable = true) {
        ChangeListBuilder list;
        list.set(id, typeOf<SurfaceProgram>(), field, value);
        edit(list.take(), undoable);
    };
    say(fieldId<&SurfaceProgram::verdict>, toValue(SurfaceProgram::kGood), false);
    EXPECT_EQ(program().verdict, SurfaceProgram::kGood);
    say(fieldId<&SurfaceProgram::reach>, toValue(2.0));
    EXPECT_EQ(program().verdict, SurfaceProgram::kGood);
    say(fieldId<&SurfaceProgram::surface>, toValue(std::string("other")));
    EXPECT_EQ(program().verdict, SurfaceProgram::kUntried);
    // What is undone comes back with its own verdict.
    std::vector<Edit> undo;
    undo.push_back({.ticket = 2, .list = {}, .kind = Edit::Kind::kUndo});
    EXPECT_TRUE(simulation.step(false, std::move(undo)).outcomes[0].result);
    EXPECT_EQ(program().surface, "mine");
    EXPECT_EQ(program().verdict, SurfaceProgram::kGood);
}

/// What is there is not said otherwise; an edit that says it as it is, or of what is new, passes.
TEST(ServersFields, NobodyElseSetsWhatTheServerFoundOut) {
    Simulation simulation;
    const auto problemOf = [&](ChangeList list, bool undoable = true) {
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = std::move(list), .undoable = undoable});
        const FrameResult result = simulation.step(false, std::move(edits));
        return result.outcomes[0].result ? std::string() : result.outcomes[0].result.error().message;
    };
    const ObjectId image{kFirstPlaceholder}, movie{kFirstPlaceholder + 1}, program{kFirstPlaceholder + 2},
        handle{kFirstPlaceholder + 3};
    ChangeListBuilder making;
    making.create(image, typeOf<Image>());
    making.create(movie, typeOf<Movie>());
    setAllFields(making, movie, Object::of(Movie{.image = image, .file = {}, .problem = "new ones may come with any"}));
    making.create(program, typeOf<SurfaceProgram>());
    making.create(handle, typeOf<Manipulator>());
    ASSERT_EQ(problemOf(making.take()), "");
    std::map<ObjectType, ObjectId> made;
    for (const ObjectId id : simulation.scene().ids()) made[simulation.scene().find(id).info().type] = id;

    const auto saying = [&]<typename T>(const T&, FieldId field, const FieldValue& value) {
        ChangeListBuilder list;
        list.set(made.at(typeOf<T>()), typeOf<T>(), field, value);
        return list.take();
    };
    const std::vector<std::function<ChangeList()>> wrong = {
        [&] { return saying(SurfaceProgram(), fieldId<&SurfaceProgram::verdict>, toValue(SurfaceProgram::kGood)); },
        [&] { return saying(SurfaceProgram(), fieldId<&SurfaceProgram::problem>, toValue(std::string("x"))); },
        [&] { return saying(Movie(), fieldId<&Movie::problem>, toValue(std::string())); },
        [&] { return saying(Manipulator(), fieldId<&Manipulator::held>, toValue(std::int64_t{2})); },
        [&] { return saying(Manipulator(), fieldId<&Manipulator::sizes>, toValue(Vec4f(1, 2, 0, 0))); },
    };
    for (const auto& list : wrong) {
        EXPECT_WORDS(problemOf(list()));
        EXPECT_EQ(problemOf(list(), false), "") << "the server itself";
    }
    EXPECT_EQ(problemOf(saying(Movie(), fieldId<&Movie::problem>, toValue(std::string()))), "") << "as it is";
}

/// What programs are told not to offer (`GET /api`) is what is refused, of every type.
TEST(ServersFields, WhatIsMarkedAsTheServersIsRefusedOfOthers) {
    std::size_t asked = 0;
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            const FieldOfServer* const known = fieldOfServer(type.type, field.id);
            if (!known || known->instead.empty()) continue;
            Simulation simulation;
            const auto edit = [&](ChangeList list) {
                std::vector<Edit> edits;
                edits.push_back({.ticket = 1, .list = std::move(list)});
                return simulation.step(false, std::move(edits)).outcomes[0].result;
            };
            ChangeListBuilder making, saying;
            making.create(ObjectId(kFirstPlaceholder), type.type);
            ASSERT_TRUE(edit(making.take())) << type.name;
            ObjectId made;
            for (const ObjectId id : simulation.scene().ids())
                if (simulation.scene().find(id).info().type == type.type) made = id;
            FieldValue value = field.load(simulation.scene().find(made));
            if (auto* number = std::get_if<std::int64_t>(&value)) ++*number;
            if (auto* text = std::get_if<std::string>(&value)) *text += "mine";
            if (auto* numbers = std::get_if<Floats>(&value)) numbers->values[0] += 1;
            saying.set(made, type.type, field.id, value);
            const auto refused = edit(saying.take());
            ASSERT_FALSE(refused) << type.name << "." << field.name;
            EXPECT_WORDS(refused.error().message);
            EXPECT_NE(refused.error().message.find(known->instead), std::string::npos) << refused.error().message;
            ++asked;
        }
    EXPECT_EQ(asked, 10u);
}

TEST(ProgramVerdicts, TooMuchIsRefusedInWords) {
    Simulation simulation;
    const auto problemOf = [&](ChangeList list) {
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = std::move(list)});
        const FrameResult result = simulation.step(false, std::move(edits));
        return result.outcomes[0].result ? std::string() : result.outcomes[0].result.error().message;
    };
    EXPECT_NE(problemOf(creating({.surface = std::string(65537, ' ')}, ObjectId(kFirstPlaceholder))), "");
    for (const std::size_t passes : {Material::kMostPasses, Material::kMostPasses + 1}) {
        ChangeListBuilder list;
        Material material;
        for (std::size_t i = 0; i < passes; ++i) {
            list.create(ObjectId(kFirstPlaceholder + 1 + i), typeOf<Material>());
            material.passes.push_back(ObjectId(kFirstPlaceholder + 1 + i));
        }
        list.create(ObjectId(kFirstPlaceholder), typeOf<Material>());
        setAllFields(list, ObjectId(kFirstPlaceholder), Object::of(material));
        const std::string problem = problemOf(list.take());
        if (passes > Material::kMostPasses)
            EXPECT_WORDS(problem);
        else
            EXPECT_EQ(problem, "");
    }
}

TEST(ProgramVerdicts, AMaterialIsNoPassOfItself) {
    Simulation simulation;
    const auto problemOf = [&](ChangeList list) {
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = std::move(list)});
        const FrameResult result = simulation.step(false, std::move(edits));
        return result.outcomes[0].result ? std::string() : result.outcomes[0].result.error().message;
    };
    ChangeListBuilder made;
    made.create(ObjectId(kFirstPlaceholder), typeOf<Material>());
    Material own;
    own.passes.push_back(ObjectId(kFirstPlaceholder));
    setAllFields(made, ObjectId(kFirstPlaceholder), Object::of(own));
    EXPECT_WORDS(problemOf(made.take()));
    for (const bool itself : {true, false}) {
        ChangeListBuilder list;
        Material material;
        for (std::uint64_t i = 0; i < 2; ++i) list.create(ObjectId(kFirstPlaceholder + i), typeOf<Material>());
        material.passes.push_back(ObjectId(kFirstPlaceholder + (itself ? 1 : 0)));
        setAllFields(list, ObjectId(kFirstPlaceholder + 1), Object::of(material));
        EXPECT_EQ(problemOf(list.take()).empty(), !itself);
    }
}

/// What a host says of a program that holds it up goes for all of its text, until that is said again. The child is not
/// asked: it has said that the text is good.
TEST_F(ProgramTrialsTest, WhatHoldsAHostUpIsHeavyUntilItIsSaidAgain) {
    Aspect scene = sceneOf({.surface = "a text"});
    constexpr ObjectId kTwin{3}, kOther{4};
    ASSERT_TRUE(scene.apply(creating({.surface = "a text"}, kTwin)));
    ASSERT_TRUE(scene.apply(creating({.surface = "another"}, kOther)));
    ProgramTrials trials(script("cat > /dev/null; printf good"));
    trials.update(scene, nullptr);
    const auto apply = [&](ChangeList list) {
        EXPECT_TRUE(scene.apply(list));
        trials.update(scene, &list);
    };
    const auto verdicts = [&] { apply(trials.verdicts(scene, std::chrono::seconds(30))); };
    const auto verdictOf = [&](ObjectId id) { return scene.get<SurfaceProgram>(id)->verdict; };
    verdicts();
    ASSERT_EQ(verdictOf(kTwin), SurfaceProgram::kGood);
    EXPECT_TRUE(trials.troubles(scene).empty());
    trials.heldUp(kProgram, "left", 500.4, FrameNumber{1});
    trials.heldUp(kTwin, "right", 600, FrameNumber{1});
    trials.heldUp(ObjectId(77), "left", 500, FrameNumber{1});
    verdicts();
    EXPECT_EQ(verdictOf(kProgram), SurfaceProgram::kHeavy);
    EXPECT_EQ(verdictOf(kTwin), SurfaceProgram::kHeavy);
    EXPECT_EQ(verdictOf(kOther), SurfaceProgram::kGood);
    EXPECT_WORDS(scene.get<SurfaceProgram>(kProgram)->problem);
    EXPECT_EQ(trials.takeRemarks().size(), 2u) << "said once each";
    ASSERT_EQ(trials.troubles(scene).size(), 2u);
    EXPECT_WORDS(trials.troubles(scene)[0]);
    // Hosts that have not heard of it yet say it again.
    trials.heldUp(kProgram, "right", 500, FrameNumber{1});
    EXPECT_TRUE(trials.verdicts(scene).empty());
    // The same text once more.
    ChangeListBuilder again;
    again.set(kProgram, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::surface>, toValue(std::string("a text")));
    ChangeList list = again.take();
    resetVerdicts(list, scene);
    apply(std::move(list));
    EXPECT_EQ(verdictOf(kProgram), SurfaceProgram::kUntried);
    verdicts();
    EXPECT_EQ(verdictOf(kProgram), SurfaceProgram::kGood);
    EXPECT_EQ(verdictOf(kTwin), SurfaceProgram::kHeavy) << "of that nobody has said anything";
    // A report may be late: what was drawn before a text was said again was another one.
    ChangeListBuilder anew;
    anew.set(kProgram, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>, toValue(SurfaceProgram::kGood));
    list = anew.take();
    EXPECT_TRUE(scene.apply(list));
    trials.update(scene, &list, FrameNumber{20});
    trials.heldUp(kProgram, "left", 500, FrameNumber{19});
    EXPECT_TRUE(trials.verdicts(scene).empty());
    EXPECT_EQ(verdictOf(kProgram), SurfaceProgram::kGood);
    trials.heldUp(kProgram, "left", 500, FrameNumber{20});
    apply(trials.verdicts(scene));
    EXPECT_EQ(verdictOf(kProgram), SurfaceProgram::kHeavy);
    EXPECT_EQ(timesTried(), 2) << "each text once";
}

/// With the program that the server starts: what is good, what does not compile, what never ends, what eats all.
TEST(ProgramTrialsForReal, TellGoodFromBad) {
    const auto verdictOf = [](const std::string& surface) {
        Aspect scene = sceneOf({.surface = surface});
        ProgramTrials trials(TESSERA_BIN_DIR "/tessera-try-program");
        trials.update(scene, nullptr);
        const ChangeList list = trials.verdicts(scene, std::chrono::seconds(60));
        if (!list.empty()) EXPECT_TRUE(scene.apply(list));
        const auto& after = *scene.get<SurfaceProgram>(kProgram);
        return TrialVerdict{after.verdict, after.problem};
    };
    const TrialVerdict good =
        verdictOf("uniform vec3 tint;\nvoid surface(inout Surface s) { for (;;) { s.base.rgb += tint; } }");
    EXPECT_EQ(good.verdict, SurfaceProgram::kGood) << good.problem;
    const TrialVerdict bad = verdictOf("// one\n\nvoid surface(inout Surface s) { s.base = nowhere; }");
    EXPECT_EQ(bad.verdict, SurfaceProgram::kBad);
    EXPECT_TRUE(bad.problem.starts_with("surface, line 3: ")) << bad.problem;
    std::string bomb = "float f0(float a) { return sin(a) * 1.1; }\n";
    for (int i = 1; i < 24; ++i)
        bomb += "float f" + std::to_string(i) + "(float a) { return f" + std::to_string(i - 1) + "(a) + f" +
                std::to_string(i - 1) + "(a + 1.0); }\n";
    EXPECT_EQ(verdictOf(bomb + "void surface(inout Surface s) { s.base.r = f23(uv.x); }").verdict,
              SurfaceProgram::kBad);
}

}  // namespace
}  // namespace tessera
