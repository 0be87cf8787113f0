#include "server/sim/FrameLoopParts.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/sim/desk/FilmFiles.h"
#include "server/sim/journal/NextEpoch.h"

namespace tessera {

FrameLoop::Impl::Impl(ServerOptions o, Log& l)
    : options(std::move(o)),
      log(l),
      opened(openJournal()),
      simulation({.threads = options.threads, .time = options.platform.time}),
      view(options.wall, options.camera, firstView(), stage()),
      steering(
          {.wall = options.wall,
           .simulation = simulation,
           .view = view,
           .takesInput = options.takesInput,
           .drags = &drags,
           .beside = {
               .look =
                   [this](LooksBeside::Look look) {
                       lookBeside([look](const Aspect& scene, Sequence) { return withoutWord(look(scene)); });
                   },
               .work = [this](LooksBeside::Work work) { workbench.add([work] { return withoutWord(work()); }); }}}),
      report(options.wall, fmt::format("{}", fmt::join(options.scenes, ", "))),
      tracking(options.wall),
      trackers(options.wall.tracking, options.platform, log),
      poses(tracking.poses(FrameNumber(0), View())),
      files(std::make_shared<SceneFiles>(options.import, options.allowed,
                                         goesOn() ? opened->state.sceneFiles() : options.scenes, goesOn())),
      actors(options.wall, drags, filmOpener(files), options.notices, options.exposure, *options.platform.time,
             options.platform.childPatience),
      maker({.simulation = simulation,
             .view = view,
             .blobs = blobs,
             .report = report,
             .log = log,
             .journal = journal(),
             .snapshots = &snapshots,
             .moveHeads = [this] { moveHeads(); },
             .showing = &options.showing,
             .steering = &steering,
             .lane = options.platform.lane}),
      pacing(options.rateHz),
      startScene(options.scenes, options.placing),
      peers(
          sessionConfig(), blobs,
          [this](LinkEvent event) {
              const LinkId link = linkOf(event);
              inbox.push(link.value, std::move(event));
          },
          options.platform, options.keys, [this](const std::string& words) { log.warning(words); }),
      loader(
          importOptions(), files, [this](Preparation made) { deliver(std::move(made)); }, options.platform.lane,
          *options.platform.time),
      workbench([this](WorkedOut then) { deliver(BesideDone{std::move(then)}); }, options.platform.lane),
      listings([this](WorkedOut then) { deliver(BesideDone{std::move(then)}); }, options.platform.lane),
      uploads([this](UploadFinished finished) { deliver(std::move(finished)); }, options.platform.lane),
      snapshots(
          peers.session(), blobs, [this](SnapshotMade made) { deliver(std::move(made)); }, options.platform.lane),
      marks(blobs, peers.session()),
      desk({.wall = options.wall,
            .blobs = blobs,
            .session = peers.session(),
            .simulation = simulation,
            .view = view,
            .loader = loader,
            .uploads = &uploads,
            .drags = drags,
            .journal = options.journalPath,
            .editsRefused = [this] { return trouble(); },
            .describeWaits =
                [this](answer::Status& status) {
                    report.describeWaits(status);
                    peers.describe(status);
                    if (journal()) status.journalBytes = journal()->writtenBytes();
                },
            .describeTrackers = [this] { return describeTrackers(); },
            .describePrograms = [this] { return actors.programs.troubles(simulation.scene()); },
            .filmLength = [this](ObjectId movie) { return actors.films.lengthOf(movie); },
            .poses = [this] { return poses; },
            .showing = &options.showing,
            .steering = &steering,
            .inlines = &actors.inlines,
            .orderSurvey = [this] { orderSurvey(); },
            .orderCopy =
                [this](Preparation order) {
                    lookBeside([this, order = std::move(order)](const Aspect& scene, Sequence) -> WorkedOut {
                        const auto made = std::make_shared<Preparation>(makeCopy(scene, order));
                        return [this, made](TimePoint now) { return desk.prepared(std::move(*made), now); };
                    });
                },
            .lookBeside = [this](DeskSurroundings::Look look) { lookBeside(std::move(look)); },
            .workBeside = [this](std::function<WorkedOut()> work) { workbench.add(std::move(work)); },
            .listBeside = [this](std::function<WorkedOut()> work) { listings.add(std::move(work)); },
            .files = files.get(),
            .budget = &actors.budget,
            .exposure = &actors.exposure,
            .watchesFiles = options.reload,
            .deliver = [this](WorkedOut then) { deliver(BesideDone{std::move(then)}); },
            .say = [this](const std::string& words, bool isWrong) { isWrong ? log.warning(words) : log.info(words); },
            .audit = options.audit,
            .time = *options.platform.time,
            .lane = options.platform.lane}),
      actions({.time = *options.platform.time,
               .peers = peers,
               .pacing = pacing,
               .snapshots = snapshots,
               .desk = desk,
               .steering = steering,
               .report = report,
               .budget = actors.budget,
               .exposure = actors.exposure,
               .programs = actors.programs,
               .log = log,
               .onReleased =
                   [this](std::uint64_t frames) {
                       if (options.onProgress) options.onProgress(frames, options.frames);
                   },
               .onAnswered =
                   [this](ServerActions told) {
                       // What was said about the view is not in a frame yet.
                       return journal() && journal()->viewIs(view) ? untilWritten(std::move(told)) : told;
                   },
               .onEpochRaised =
                   [this](Epoch epoch) {
                       if (journal()) journal()->epochRaised(epoch);
                   },
               .deliver = [this](StateCompared found) { deliver(std::move(found)); }}) {
    inbox.setRank(kOurselves, Inbox::Rank::kFirst);
    simulation.actWith(actors);
    view.surveyElsewhere([this] { return orderSurvey(), simulation.sequence(); });
}

Expected<Journal::Opened> FrameLoop::Impl::openJournal() {
    if (options.journalPath.empty()) return Journal::Opened();
    return Journal::open({.folder = options.journalPath,
                          .scenes = options.scenes,
                          .placing = optionsText(options.placing),
                          .calls = options.journalFiles ? options.journalFiles : std::make_shared<FileSystem>(),
                          .lane = options.platform.lane,
                          .time = options.platform.time},
                         blobs, log, [this] { deliver(JournalProgress{}); });
}

/// That of a wall that goes on is the one that it began with, whatever this command leaves unsaid.
FirstView FrameLoop::Impl::firstView() const {
    bool inMetres = !options.scenes.empty() && options.placing.isInMetres();
    if (goesOn()) {
        const std::string words = opened->state.placing();
        inMetres = words.find("--at ") != std::string::npos || words.find("--fit ") != std::string::npos;
    }
    return inMetres ? FirstView::kOfWall : FirstView::kOfScene;
}

/// Scenes in Tessera's own formats look as they are written.
Stage FrameLoop::Impl::stage() const {
    const std::vector<std::string> scenes = goesOn() ? opened->state.sceneFiles() : options.scenes;
    const bool models = !scenes.empty() && std::ranges::none_of(scenes, [](const std::string& scene) {
        return scene.ends_with(".tsc") || scene.ends_with(".tsct");
    });
    return options.studio && models ? Stage::kStudio : Stage::kPlain;
}

/// Files within files of what stands in metres keep their cameras to themselves, as those do.
ImportOptions FrameLoop::Impl::importOptions() const {
    ImportOptions import = options.import;
    import.camerasEnabled = firstView() == FirstView::kOfScene;
    return import;
}

ServerSessionConfig FrameLoop::Impl::sessionConfig() const {
    const DateTime now = options.platform.date();
    ServerSessionConfig config = sessionConfigOf(options.wall, journal() ? journal()->epoch() : nextEpoch({}, now));
    config.furthestSeen = furthestEpoch(now);
    config.newToken = [random = options.platform.random] {
        const Hash128 bits = random();
        return SessionToken{bits.low, bits.high};
    };
    config.access = options.access;
    config.owner = options.owner;
    config.insecure = options.insecure;
    config.panelOf = options.panelOf;
    if (journal()) config.firstFrame = opened->state.nextFrame;
    return config;
}

}  // namespace tessera
