// Films in a scene, decoded by the real child: what each frame shows, and what goes wrong in words.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>

#include <fstream>
#include <random>

#include "common/cores/Image.h"
#include "common/cores/Movie.h"
#include "common/scene/FieldTable.h"
#include "server/movies/Movies.h"
#include "server/sim/desk/FilmFiles.h"
#include "server/sim/frame/Simulation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/movies/NumberedFilm.h"
#include "tests/unit/movies/Seed.h"

namespace tessera::test {
namespace {

const std::string kDecoder = TESSERA_BIN_DIR "/tessera-decode-film";

/// A simulation beside which films play, as in FrameMaker.
class Cinema {
public:
    explicit Cinema(std::string folder)
        : movies_(filmOpener(std::make_shared<SceneFiles>(ImportOptions(), std::vector{std::move(folder)})), kDecoder) {
        movies_.update(simulation_.scene(), nullptr);
    }

    /// A film and its image, of one black pixel.
    ObjectId add(const std::string& file, const Movie& like = {}) {
        ChangeListBuilder list;
        const ObjectId image{kFirstPlaceholder}, movie{kFirstPlaceholder + 1};
        list.create(image, typeOf<Image>());
        setField<&Image::pixels>(list, image,
                                 Blob::of(std::span<const std::uint8_t>(std::array<std::uint8_t, 4>{0, 0, 0, 255})));
        setField<&Image::widthPx>(list, image, std::int64_t{1});
        setField<&Image::heightPx>(list, image, std::int64_t{1});
        list.create(movie, typeOf<Movie>());
        Movie said = like;
        said.file = file;
        said.image = image;
        setAllFields(list, movie, Object::of(said));
        const EditOutcome outcome = frame(list.take());
        EXPECT_TRUE(outcome.result) << outcome.result.error().message;
        return outcome.result && outcome.result->ids.size() == 2 ? outcome.result->ids[1].second : ObjectId{};
    }
    /// One frame, with an edit of a person's where there is one.
    EditOutcome frame(ChangeList edit = {}, Edit::Kind kind = Edit::Kind::kChange) {
        std::vector<Edit> edits;
        for (ChangeList& list : movies_.advance(simulation_.scene(), kSecondsPerFrame, clockNow()))
            edits.push_back({.ticket = Movies::kTicket, .list = std::move(list), .undoable = false});
        const std::size_t own = edits.size();
        const bool asked = !edit.empty() || kind != Edit::Kind::kChange;
        if (asked) edits.push_back({.list = std::move(edit), .kind = kind});
        const FrameResult result = simulation_.step(false, std::move(edits));
        for (std::size_t i = 0; i < own; ++i)
            EXPECT_TRUE(result.outcomes[i].result) << result.outcomes[i].result.error().message;
        if (result.commit.list) movies_.update(simulation_.scene(), result.commit.list.get());
        return asked ? result.outcomes.back() : EditOutcome();
    }
    template <auto kMember, typename T>
    Expected<answer::Committed> set(ObjectId id, const T& value) {
        ChangeListBuilder list;
        setField<kMember>(list, id, value);
        return frame(list.take()).result;
    }
    [[nodiscard]] const Movie& movie(ObjectId id) const { return *simulation_.scene().get<Movie>(id); }
    [[nodiscard]] const Image& image(ObjectId id) const { return *simulation_.scene().get<Image>(movie(id).image); }
    /// The number of the picture that is shown; -1: none.
    [[nodiscard]] int number(ObjectId id) const {
        const Image& now = image(id);
        return now.widthPx == 1 ? -1
                                : numberIn(now.pixels.as<std::uint8_t>(), static_cast<int>(now.widthPx),
                                           static_cast<int>(now.heightPx));
    }
    /// Frames, at the pace of a wall, until something holds; false: not in time.
    bool until(const std::function<bool()>& holds) {
        return eventually([&] {
            frame();
            return holds();
        });
    }
    bool showsOrFails(ObjectId id) {
        return until([&] { return number(id) >= 0 || !movie(id).problem.empty(); });
    }

    Simulation simulation_;
    Movies movies_;
};

class MoviesTest : public testing::Test {
protected:
    std::string film(const std::string& name, const FilmRecipe& recipe) {
        EXPECT_TRUE(makeFilm(folder_ / name, recipe));
        return folder_ / name;
    }
    TestFolder folder_;
    Cinema cinema_{folder_.path()};
};

TEST_F(MoviesTest, AFilmThatStandsShowsThePictureOfItsTimeWhateverWasSoughtBefore) {
    const std::uint64_t seed = seedOfRun();
    SCOPED_TRACE(againWith(seed));
    std::mt19937_64 random(seed);
    const ObjectId id =
        cinema_.add(film("a.mp4", {.codec = "mpeg4", .pixels = "yuv420p", .pictures = 60, .keyEvery = 15}),
                    {.playing = false, .time = 0.42});
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 10; })) << cinema_.movie(id).problem;
    EXPECT_EQ(cinema_.movie(id).time, 0.42) << "it stands";
    EXPECT_EQ(cinema_.image(id).widthPx, 64);
    for (int i = 0; i < 12; ++i) {
        const int wanted = static_cast<int>(random() % 60);
        ASSERT_TRUE((cinema_.set<&Movie::time>(id, 0.04 * wanted + 0.02)));
        ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == wanted; })) << wanted;
    }
    // Undo is a seek back; the pictures are no steps.
    ASSERT_TRUE((cinema_.set<&Movie::time>(id, 2.02)));
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 50; }));
    const double before = cinema_.movie(id).time;
    ASSERT_TRUE(cinema_.frame({}, Edit::Kind::kUndo).result);
    EXPECT_NE(cinema_.movie(id).time, before);
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == static_cast<int>(cinema_.movie(id).time / 0.04); }));
    // A seek beyond shows what is there, folded into the film.
    ASSERT_TRUE((cinema_.set<&Movie::time>(id, 2.4 * 1000 + 0.1)));
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 2; })) << cinema_.movie(id).time;
    ASSERT_TRUE((cinema_.set<&Movie::time>(id, -0.3)));
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 52; })) << cinema_.movie(id).time;
}

TEST_F(MoviesTest, APausedFilmCostsNothing) {
    const ObjectId id = cinema_.add(film("a.mkv", {}), {.playing = false});
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 0; }));
    for (int i = 0; i < 5; ++i) cinema_.frame();
    const std::uint64_t asked = cinema_.movies_.requests(), sequence = cinema_.simulation_.sequence().value;
    for (int i = 0; i < Movies::kPatience + 2; ++i) cinema_.frame();
    EXPECT_EQ(cinema_.movies_.requests(), asked);
    EXPECT_EQ(cinema_.simulation_.sequence().value, sequence) << "nothing is written";
    EXPECT_EQ(cinema_.movies_.running(), 0u) << "its process has gone";
    ASSERT_TRUE((cinema_.set<&Movie::playing>(id, true)));
    EXPECT_TRUE(cinema_.until([&] { return cinema_.number(id) == 5; })) << "and comes back";
}

TEST_F(MoviesTest, WhatPlaysShowsEachPictureInOrderAndBeginsAgain) {
    const ObjectId id = cinema_.add(film("a.mkv", {.pictures = 10}));
    std::vector<int> seen;
    ASSERT_TRUE(cinema_.until([&] {
        const int now = cinema_.number(id);
        if (now >= 0 && (seen.empty() || seen.back() != now)) seen.push_back(now);
        return seen.size() >= 35;
    })) << cinema_.movie(id).problem;
    int leftOut = 0;
    for (std::size_t i = 1; i < seen.size(); ++i) leftOut += (seen[i] - seen[i - 1] + 9) % 10;
    // A machine that is busy may leave some out; none is out of order, or twice around would be left out.
    EXPECT_LE(leftOut, 10) << fmt::format("{}", fmt::join(seen, " "));
    EXPECT_LE(std::abs(cinema_.movie(id).time - 0.04 * cinema_.number(id) - 0.02), 0.2)
        << "what is shown is what is due";
    EXPECT_NEAR(cinema_.movies_.lengthOf(id), 0.4, 1e-3);
    EXPECT_EQ(cinema_.movies_.lengthOf(ObjectId{999}), 0);
    ASSERT_TRUE(cinema_.set<&Movie::file>(id, std::string("/none/such.mkv")));
    EXPECT_EQ(cinema_.movies_.lengthOf(id), 0) << "of another file nothing is known";
}

TEST_F(MoviesTest, OnceEndsWithTheLastPictureAndBackwardsWithTheFirst) {
    const ObjectId id = cinema_.add(film("a.mkv", {.pictures = 12, .keyEvery = 4}), {.mode = Movie::kOnce});
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) == 11; }));
    for (int i = 0; i < 30; ++i) cinema_.frame();
    EXPECT_EQ(cinema_.number(id), 11);
    EXPECT_NEAR(cinema_.movie(id).time, 0.48, 0.05);
    ASSERT_TRUE((cinema_.set<&Movie::speed>(id, -1.0)));
    std::vector<int> seen{11};
    ASSERT_TRUE(cinema_.until([&] {
        if (seen.back() != cinema_.number(id)) seen.push_back(cinema_.number(id));
        return cinema_.number(id) == 0;
    }));
    EXPECT_TRUE(std::ranges::is_sorted(seen, std::greater())) << fmt::format("{}", fmt::join(seen, " "));
    EXPECT_GE(seen.size(), 3u);
    ASSERT_TRUE((cinema_.set<&Movie::mode>(id, Movie::kLoop)));
    EXPECT_TRUE(cinema_.until([&] { return cinema_.number(id) >= 8; })) << "backwards around its start";
}

TEST_F(MoviesTest, AGreatSpeedLeavesOutAndPilesNothingUp) {
    const ObjectId id = cinema_.add(film("a.mkv", {.pictures = 200}), {.speed = 1000});
    ASSERT_TRUE(cinema_.showsOrFails(id));
    const std::uint64_t before = cinema_.movies_.requests();
    std::set<int> seen;
    unsigned frames = 0;
    EXPECT_TRUE(cinema_.until([&] {
        seen.insert(cinema_.number(id));
        return ++frames >= 200 && seen.size() >= 3;
    })) << seen.size();
    EXPECT_LE(cinema_.movies_.requests() - before, frames + Movies::kMostAhead);
    ASSERT_TRUE((cinema_.set<&Movie::playing>(id, false)));
    const int there = static_cast<int>(cinema_.movie(id).time / 0.04);
    EXPECT_TRUE(cinema_.until([&] { return std::abs(cinema_.number(id) - there) <= 1; }))
        << "when it stands it shows where it stands";
}

TEST_F(MoviesTest, WhatCannotBeShownSaysWhyAndTheLastPictureStays) {
    const ObjectId none = cinema_.add(folder_ / "none.mp4");
    ASSERT_TRUE(cinema_.showsOrFails(none));
    EXPECT_NE(cinema_.movie(none).problem, "");
    const ObjectId elsewhere = cinema_.add("/etc/passwd");
    ASSERT_TRUE(cinema_.showsOrFails(elsewhere));
    EXPECT_WORDS(cinema_.movie(elsewhere).problem);
    const ObjectId sound = cinema_.add(film("sound.wav", {.codec = "", .sound = true}));
    ASSERT_TRUE(cinema_.showsOrFails(sound));
    EXPECT_EQ(cinema_.movie(sound).problem, "it has sound and no moving pictures");
    EXPECT_EQ(cinema_.movie(sound).time, 0) << "its clock stands";
    const ObjectId id = cinema_.add(film("a.mkv", {.pictures = 100}));
    ASSERT_TRUE(cinema_.until([&] { return cinema_.number(id) >= 3; }));
    ::kill(cinema_.movies_.processOf(id), SIGKILL);
    ASSERT_TRUE(cinema_.until([&] { return !cinema_.movie(id).problem.empty(); }));
    EXPECT_WORDS(cinema_.movie(id).problem);
    EXPECT_GE(cinema_.number(id), 3);
    const double stood = cinema_.movie(id).time;
    for (int i = 0; i < 10; ++i) cinema_.frame();
    EXPECT_EQ(cinema_.movie(id).time, stood);
    ASSERT_TRUE((cinema_.set<&Movie::playing>(id, true)));
    EXPECT_TRUE(cinema_.until([&] { return cinema_.movie(id).problem.empty() && cinema_.movie(id).time > stood; }))
        << "played again it goes on";
    ASSERT_TRUE((cinema_.set<&Movie::image>(id, ObjectId())));
    cinema_.frame();
    EXPECT_EQ(cinema_.movie(id).problem, "it names no image");
}

TEST_F(MoviesTest, TwoFilmsDoNotWriteOneImage) {
    const std::string path = film("a.mkv", {});
    const ObjectId first = cinema_.add(path), second = cinema_.add(path);
    const Expected<answer::Committed> refused = cinema_.set<&Movie::image>(second, cinema_.movie(first).image);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    ChangeListBuilder swapped;
    const ObjectId one = cinema_.movie(first).image, other = cinema_.movie(second).image;
    setField<&Movie::image>(swapped, first, other);
    setField<&Movie::image>(swapped, second, one);
    EXPECT_TRUE(cinema_.frame(swapped.take()).result) << "each has one";
}

TEST_F(MoviesTest, ManyFilmsWaitForTheirTurn) {
    const std::string path = film("a.mkv", {});
    std::vector<ObjectId> ids;
    for (std::size_t i = 0; i < Movies::kMostFilms + 2; ++i)
        ids.push_back(cinema_.add(path, {.playing = i < Movies::kMostFilms}));
    ASSERT_TRUE(cinema_.until([&] {
        return std::ranges::all_of(
            ids, [&](ObjectId id) { return cinema_.number(id) >= 0 || !cinema_.movie(id).problem.empty(); });
    }));
    EXPECT_LE(cinema_.movies_.running(), Movies::kMostFilms);
    EXPECT_WORDS(cinema_.movie(ids.back()).problem);
    // Who stands gives way at once to who wants to play.
    EXPECT_TRUE((cinema_.set<&Movie::playing>(ids[0], false)));
    const auto waiting = [&] {
        return static_cast<std::size_t>(
            std::ranges::count_if(ids, [&](ObjectId id) { return !cinema_.movie(id).problem.empty(); }));
    };
    ASSERT_EQ(waiting(), 2u);
    int frames = 0;
    EXPECT_TRUE(cinema_.until([&] { return ++frames, waiting() == 1; }));
    EXPECT_LT(frames, Movies::kPatience) << "nobody waits until a child has stood for long";
    EXPECT_LE(cinema_.movies_.running(), Movies::kMostFilms);
    for (std::size_t i = 0; i < 2; ++i) {
        ChangeListBuilder gone;
        gone.destroy(ids[i]);
        EXPECT_TRUE(cinema_.frame(gone.take()).result);
    }
    EXPECT_TRUE(
        cinema_.until([&] { return cinema_.number(ids.back()) >= 0 && cinema_.movie(ids.back()).problem.empty(); }));
}

// Whatever is edited, undone, killed meanwhile: no edit of the films' is refused, no process is left, and in the end
// each film that stands shows its time.
TEST_F(MoviesTest, RandomHistoriesEndWithThePictureThatIsDue) {
    const std::uint64_t seed = seedOfRun();
    SCOPED_TRACE(againWith(seed));
    std::mt19937_64 random(seed);
    const std::vector<std::string> films = {
        film("a.mkv", {.pictures = 40}),
        film("b.mp4", {.codec = "mpeg4", .pixels = "yuv420p", .widthPx = 46, .heightPx = 38, .pictures = 70}),
        film("c.gif", {.codec = "gif", .pixels = "gray", .pictures = 20}), folder_ / "missing.mp4"};
    std::vector<ObjectId> ids;
    for (std::size_t i = 0; i < 3; ++i) ids.push_back(cinema_.add(films[i]));
    for (int step = 0; step < 300; ++step) {
        const ObjectId id = ids[random() % ids.size()];
        const bool there = cinema_.simulation_.scene().get<Movie>(id);
        switch (there ? random() % 12 : 11) {
            case 0:
                (void)cinema_.set<&Movie::time>(id, std::uniform_real_distribution<>(-3, 5)(random));
                break;
            case 1:
                (void)cinema_.set<&Movie::speed>(id, std::array{-1.0, 0.0, 1.0, 3.0, -1e6, 1e6, 0.01}[random() % 7]);
                break;
            case 2:
                (void)cinema_.set<&Movie::playing>(id, random() % 2 == 0);
                break;
            case 3:
                (void)cinema_.set<&Movie::mode>(id, static_cast<std::int64_t>(random() % 2));
                break;
            case 4:
                (void)cinema_.set<&Movie::file>(id, films[random() % films.size()]);
                break;
            case 5:
                if (const pid_t child = cinema_.movies_.processOf(id); child > 0) ::kill(child, SIGKILL);
                break;
            case 6: {
                ChangeListBuilder gone;
                gone.destroy(id);
                (void)cinema_.frame(gone.take());
                break;
            }
            case 7:
                (void)cinema_.set<&Movie::image>(
                    id, random() % 3 == 0 ? ObjectId()
                                          : cinema_.movie(ids[random() % ids.size()].value == 0 ? id : id).image);
                break;
            case 11:
                (void)cinema_.frame({}, random() % 3 == 0 ? Edit::Kind::kRedo : Edit::Kind::kUndo);
                break;
            default:
                cinema_.frame();
        }
        if (random() % 4 == 0) aMoment(random, std::chrono::milliseconds(6));
    }
    for (const ObjectId id : ids) {
        if (!cinema_.simulation_.scene().get<Movie>(id) || !cinema_.movie(id).image) continue;
        ASSERT_TRUE((cinema_.set<&Movie::file>(id, films[0])));
        ASSERT_TRUE((cinema_.set<&Movie::playing>(id, false)));
        ASSERT_TRUE((cinema_.set<&Movie::time>(id, 0.58)));
        EXPECT_TRUE(cinema_.until([&] { return cinema_.number(id) == 14 && cinema_.movie(id).problem.empty(); }))
            << cinema_.movie(id).problem << " " << cinema_.number(id);
    }
}

// Its limit of processor time is renewed by itself with each picture: whoever has taken it over would renew it for
// ever.
TEST_F(MoviesTest, WhoWorksThoughNothingIsAskedIsEnded) {
    const std::string program = folder_ / "busy";
    std::ofstream(program) << "#!/bin/sh\nwhile :; do :; done\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    auto process = FilmProcess::start(FileHandle(::open("/dev/null", O_RDONLY | O_CLOEXEC)), program);
    ASSERT_TRUE(process) << process.error().message;
    std::string problem;
    EXPECT_TRUE(eventually([&] {
        const auto frames = process->poll(clockNow());
        if (!frames) problem = frames.error().message;
        return !frames;
    }));
    EXPECT_EQ(problem, "who decodes it works though nothing is asked of it");
}

TEST_F(MoviesTest, BrokenFilmsCostTheirChildAndOneMessage) {
    const std::uint64_t seed = seedOfRun();
    SCOPED_TRACE(againWith(seed));
    std::mt19937_64 random(seed);
    std::vector<std::string> whole;
    for (const auto& [name, codec, pixels] :
         {std::tuple("a.mp4", "mpeg4", "yuv420p"), std::tuple("b.mkv", "ffv1", "bgr0"),
          std::tuple("c.avi", "mjpeg", "yuvj420p"), std::tuple("d.gif", "gif", "gray"),
          std::tuple("e.ts", "mpeg2video", "yuv420p"), std::tuple("f.mov", "png", "rgb24")}) {
        std::ifstream in(film(name, {.codec = codec, .pixels = pixels, .pictures = 8}), std::ios::binary);
        whole.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    int shown = 0, refused = 0;
    for (int i = 0; i < 60; ++i) {
        std::string bytes = whole[static_cast<std::size_t>(i) % whole.size()];
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        for (std::size_t n = random() % 40; n > 0 && !bytes.empty(); --n)
            bytes[random() % bytes.size()] = static_cast<char>(random());
        const std::string path = folder_ / "broken";
        std::ofstream(path, std::ios::binary) << bytes;
        auto process = FilmProcess::start(FileHandle(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), kDecoder);
        ASSERT_TRUE(process);
        // The child has the descriptor of this file, whatever is written over its name.
        ::unlink(path.c_str());
        std::string problem;
        for (int request = 0; request < 8 && problem.empty(); ++request) {
            process->ask({.flags = random() % 2 == 0 ? FilmRequest::kFollowing | FilmRequest::kLoop : 0,
                          .seconds = 0.05 * static_cast<double>(random() % 10)},
                         clockNow());
            const auto answers = [&] {
                const auto frames = process->poll(clockNow());
                if (!frames) problem = frames.error().message;
                return !frames || !frames->empty();
            };
            ASSERT_TRUE(eventually(answers, std::chrono::seconds(FilmProcess::kSeconds + 5)));
        }
        EXPECT_NE(problem, "who decodes it says nonsense");
        problem.empty() ? ++shown : ++refused;
    }
    EXPECT_GT(shown, 0);
    EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace tessera::test
