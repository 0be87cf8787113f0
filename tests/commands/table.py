"""How each command line of extract.py is run once, small. What no row here knows, and no rule of plan.py, is an error
of the test `commands.List`.

`$T` is a folder of the run's own, `$BUILT` the build folder with the tests, `$DATA` the real models
(TESSERA_TEST_DATA); `ctl` asks the wall of the row's scene, whose address is `$WALL`. A port of one's own: `$PORT`,
`$PORT2`.
"""
from dataclasses import dataclass

HALL = "deploy/scenes/engine-hall.tsct"
YARD = "tests/data/scenes/yard.tsct"
SURFACE = "tests/data/scenes/surface.tsct"


@dataclass
class Row:
    group: str  # the test that runs it
    run: str = ""  # shell; empty: the line as it stands
    scene: str = ""  # a wall (a server, a host) runs it meanwhile
    draws: bool = False  # that host does
    options: str = ""  # of that wall's server, after --scene
    display: bool = False  # on a desktop without a screen
    keys: str = ""  # typed on a terminal
    code: int = 0
    says: str = ""  # must be in what it says
    leaves: tuple = ()  # files that must be there afterwards
    needs: tuple = ()  # programs, or folders below $DATA; without them it says that it was skipped
    changes: tuple = ()  # (what, by what) of the line, where that says it shorter than `run`
    slow: bool = False  # takes minutes: in run-tests --all alone
    elsewhere: str = ""  # nothing is run: why, and what shows it


def asked(run, scene=YARD, **more):
    return Row("Asked", run, scene, draws=True, **more)


def file(run, **more):
    return Row("Files", run, **more)


RAN = "[       OK ]"  # of a program of tests
SELF = Row("", elsewhere="it is what runs this list")
SSH = Row("", elsewhere="needs sshd: integration.StartedBySsh runs it against one on loopback")
# The wall file of the guide on real screens, as the guide has it.
MY_WALL = "tests/commands/made wall deploy/real-screens.md >$T/my.wall"

# Of a wall 1x1, with a key for its host.
KEYS = "cd $T && tessera-keys init --wall 1x1 && tessera-keys host all"


def keys(run, **more):
    return Row("Files", f"{KEYS} && {run}", **more)


ROWS = {
    # ------------------------------------------------------------------ the scripts
    "./deploy/run-tests": Row("ScriptsOfTests", "./deploy/run-tests --no-install -R '^unit_base\\.Hash'",
                              says="passed, 0 skipped"),
    "./deploy/run-tests --all": SELF,
    # where nothing may be mounted: else it is what runs this list
    "./deploy/run-tests --bare": Row(
        "ScriptsOfTests", "mkdir $T/refuses && ln -s /bin/false $T/refuses/unshare && PATH=$T/refuses:$PATH "
                          "./deploy/run-tests --no-install --bare -R '^unit_base\\.Hash'",
        says="passed, 0 skipped; not in a bare Debian: mounting is refused here"),
    "./deploy/run-tests --times": Row("ScriptsOfTests",
                                      "./deploy/run-tests --no-install --times -R '^unit_base\\.Hash'", slow=True),
    "./deploy/run-tests --fuzz 60": Row("ScriptsOfTests", "./deploy/run-tests --no-install --fuzz 1",
                                        needs=("clang++-14",), slow=True),
    "./deploy/install PREFIX": Row("Install", "./deploy/install --no-install $T/prefix", says="install: ",
                                   leaves=("$T/prefix/bin/tessera-window", "$T/prefix/share/tessera/LICENSE")),
    # Of what has just been installed.
    "tessera-wall --wall 2x2 --scene share/tessera/scenes/materials.tsct": Row(
        "Installed", "./deploy/install --no-install $T/prefix && cd $T/prefix && bin/tessera-wall --wall 1x1 --scene "
                     "share/tessera/scenes/materials.tsct --frames 2 --size 64x36", leaves=("$T/prefix/out/wall.png",)),
    "tessera-wall --wall 2x2 --assets /usr/share/assimp/models": Row("", elsewhere="the beginning of a line"),
    "./deploy/packages": Row("Install", "./deploy/packages --no-install $T/packages", says="packages: 8 in",
                             leaves=("$T/packages/tessera_0.1.0_all.deb", "$T/packages/debug"),
                             needs=("dh", "help2man", "lintian"), slow=True),
    "tessera-wall": file("cd $T && tessera-wall --wall 1x1 --frames 2 --size 64x36", leaves=("$T/out/wall.png",)),
    "./deploy/install": Row("Install", code=2, says="usage: ./deploy/install"),
    "./deploy/install /opt/tessera": Row("", elsewhere="install PREFIX, to another place"),
    "./deploy/build build tessera_blender": Row("Build", "./deploy/build build tessera_blender",
                                                leaves=("build/blender/tessera_link.zip",)),
    "./deploy/build build tessera-collide": Row(
        "Build", 'mkdir -p out/bin; ln -sf /nowhere/tessera-gone out/bin/; '
                   './deploy/build build tessera-collide && out/bin/tessera-collide --help >$T/log; [ ! -L '
                   'out/bin/tessera-gone ]; '
                   '[ -z "${SANDBOX:-}" ] || [ ! -e out/bin/tessera-wall ]'),
    "./deploy/run-drill --rows crowd-port,crowd-door": Row("Build",
                                                           "./deploy/run-drill --no-install --rows crowd-port "
                                                           "--seconds 5 --nodes 1000", needs=("ip",),
                                                           leaves=("out/drill.json",), slow=True),
    "./deploy/run-drill": Row("Build", "./deploy/run-drill --no-install --rows kill-host --repetitions 1 --nodes 1000",
                              needs=("ip",), leaves=("out/drill.json",)),
    "./deploy/run-bench": Row("ScriptsOfTests", code=2, says="which one?"),
    "./deploy/run-tests --fuzz": Row("", elsewhere="tests/fuzz/README.md has the whole line"),
    "./deploy/run-bench compile": Row("Benches", "run_bench compile --only tessera_rays_kernels", slow=True),
    './deploy/run-bench compile --cores "Material Camera"': Row(
        "", elsewhere="as without --cores, and once more for each"),
    "./deploy/run-bench compile --all": Row("", elsewhere="as without --all, and half an hour more"),
    "./deploy/run-bench lock --runs 5 --size 640x360": Row("Benches",
                                                           "run_bench lock --runs 1 --size 64x36 --frames 20 --walls "
                                                           "nothing --cases idle --privileges with"),
    # Those in Python run as they are: the stand-in makes only compiled ones short.
    "./deploy/run-bench door": Row("BenchesInPython", "run_bench door --seconds 1 --rows keys,swarm,single"),
    "./deploy/run-bench door --rows readers --seconds 5": Row("BenchesInPython",
                                                              "run_bench door --rows readers --seconds 0.5"),
    "./deploy/run-bench console": Row("BenchesInPython", "run_bench console --rows look --seconds 1"),
    "./deploy/run-bench console --rows reload": Row("BenchesInPython",
                                                    "run_bench console --rows reload --seconds 0.5"),
    "./deploy/run-bench blender": Row("BenchesInPython", "run_bench blender --rows few --moves 20"),
    "./deploy/run-bench looks": Row("BenchesInPython", "run_bench looks --only metal-roughness --size 64"),
    "./deploy/run-bench looks --formats": Row("BenchesInPython",
                                              "run_bench looks --formats --only stl/Wuson --size 64"),
    "./deploy/run-bench NAME": Row("", elsewhere="each benchmark that a line names is run"),
    "./deploy/run-wall --gallery": Row("Gallery",
                                       "TESSERA_GALLERY_PORT=$PORT ./deploy/run-wall --no-install --gallery --wall "
                                       "1x1 --size 96x54", needs=("gm",), slow=True, says=" rooms",
                                       leaves=("out/gallery.png", "out/gallery.html")),
    "./deploy/run-wall --scene MODEL.glb": Row(
        "Options", "./deploy/run-wall --no-install --frames 2 --size 64x36 --wall 1x1 "
                   "--scene /usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"),
    "./deploy/run-wall --scene MODEL.stl": Row(
        "Options", "./deploy/run-wall --no-install --scene tests/data/models/wedge.stl --wall 1x1 --size 64x36 "
                   "--frames 2 --output $T", says="2 frames"),
    "./deploy/run-wall --scene MODEL.stl --plain": Row(
        "Options", "./deploy/run-wall --no-install --scene tests/data/models/wedge.stl --plain --wall 1x1 --size 64x36 "
                   "--frames 2 --output $T", says="2 frames"),
    "./deploy/run-wall --scene MODEL.glb --exposure -3": Row(
        "Options", "./deploy/run-wall --no-install --scene tests/data/models/sunlit.glb --exposure -3 --tone-map aces "
                   "--wall 1x1 --size 64x36 --frames 2 --output $T", says="2 frames"),
    "./deploy/run-wall --scene MODEL.glb --exposure metered": Row(
        "Options", "./deploy/run-wall --no-install --scene tests/data/models/arm.glb --exposure metered --wall 1x1 "
                   "--size 64x36 --frames 2 --output $T", says="2 frames"),
    "./deploy/run-wall --scene MODEL.stl --up z --fit 2 --wall cave4": Row(
        "Options", "./deploy/run-wall --no-install --scene /usr/share/assimp/models/STL/Spider_ascii.stl --up z --fit "
                   "2 --frames 2 --size 64x36 --wall cave4"),
    "./deploy/run-wall --help": Row("Options", "./deploy/run-wall --help", says="--point-radius R"),
    # in a sandbox alone: in a tree of one's own it would compile everything anew
    "cmake -DTESSERA_UNITY=OFF build": Row(
        "Build", '[ -n "${SANDBOX:-}" ] || exit 77; ./deploy/build build tessera-ctl && '
                 'cmake -DTESSERA_UNITY=OFF build >$T/log && ninja -C build '
                 'tessera-ctl >$T/log && [ -e build/client/ctl/CMakeFiles/tessera_ctl.dir/Verbs.cpp.o ]'),
    "cmake --install": Row("", elsewhere="install PREFIX runs it"),
    "./deploy/run-tests --only NAME": Row("", elsewhere="support.RunTests; it builds all"),
    "TESSERA_WORDS=write ./deploy/run-tests --only NAME": Row("", elsewhere="each test that reads sentences"),

    # ------------------------------------------------------------------ programs of tests, by themselves
    "TESSERA_SAY=1 build/bin/unit_geometry --gtest_filter=EarClipping.*": Row(
        "Tests", "TESSERA_SAY=1 $BUILT/bin/unit_geometry --gtest_filter='EarClipping.*'", says=RAN),
    "build/bin/wall": Row("Tests", "$BUILT/bin/wall --gtest_filter='SimulatedWall.Ends*'", says=RAN),
    "build/bin/storm --seed 7 --no-pictures": Row(
        "Tests", "$BUILT/bin/storm --seed 7 --no-pictures --seconds 1", says="no law broken"),
    "./deploy/run-tests --hunt N": Row("", elsewhere="support.RunTests; it runs all tests N times"),
    "./deploy/run-tests --storm 600": Row("", elsewhere="the row of build/bin/storm; it builds all"),
    "TESSERA_RUNS=300 build/bin/unit_bodies": Row("Tests", "TESSERA_RUNS=5 $BUILT/bin/unit_bodies", says=RAN),
    "build/bin/fuzz_lists tests/fuzz/corpus/lists": Row("Tests", "$BUILT/bin/fuzz_lists tests/fuzz/corpus/lists"),
    "TESSERA_SEED=44 ./bin/sim_cluster --gtest_filter=ClusterSimulation.KeepsItsLawsWhereEverybodyWaits": Row(
        "Tests", "cd $BUILT && TESSERA_SEED=44 ./bin/sim_cluster "
                 "--gtest_filter=ClusterSimulation.KeepsItsLawsWhereEverybodyWaits", says=RAN),
    "TESSERA_SEED=N build/bin/truth_subdivision": Row("Tests",
                                                      "TESSERA_SEED=7 $BUILT/bin/truth_subdivision "
                                                      "--gtest_filter=FreeformSweep.MissesNoContactOfAnyNet", says=RAN),
    "TESSERA_SEED=N build/bin/unit_freeform_query": Row("Tests",
                                                        "TESSERA_SEED=7 $BUILT/bin/unit_freeform_query "
                                                        "--gtest_filter='FreeformBoxGaps.*'", says=RAN),
    "TESSERA_SEED=7 build/bin/unit_manipulators": Row("Tests",
                                                      "TESSERA_SEED=7 $BUILT/bin/unit_manipulators "
                                                      "--gtest_filter='Drag.*'", says=RAN),
    "TESSERA_RUNS=1000000 build/bin/unit_import --gtest_filter='*Damage.Leads*'": Row(
        "Tests", "TESSERA_RUNS=50 $BUILT/bin/unit_import --gtest_filter='*Damage.Leads*'", says=RAN),
    "TESSERA_SEED=7 build/bin/unit_movies": Row("Tests",
                                                "TESSERA_SEED=7 $BUILT/bin/unit_movies "
                                                "--gtest_filter='*RandomHistories*'", says=RAN),
    "TESSERA_SEED=N build/bin/unit_subdivision": Row("Tests",
                                                     "TESSERA_SEED=7 $BUILT/bin/unit_subdivision "
                                                     "--gtest_filter=LimitEvaluator.HasNoGapsAcrossAnyEdge", says=RAN),

    # ------------------------------------------------------------------ on a wall that runs
    # Programs in Python.
    "PYTHONPATH=build/python deploy/examples/python/parts.py ADDR:PORT": asked(
        "PYTHONPATH=$BUILT/python deploy/examples/python/parts.py $WALL --frames 3", says="moved 3 parts"),
    'PYTHONPATH=build/python deploy/examples/python/swarm.py "$(build/bin/tessera-ctl link)"': asked(
        'PYTHONPATH=$BUILT/python deploy/examples/python/swarm.py "$(ctl link)" --frames 3', says="moved 10000"),
    "PYTHONPATH=build/python deploy/examples/python/swarm.py ADDR:PORT": asked(
        "PYTHONPATH=$BUILT/python deploy/examples/python/swarm.py $WALL --frames 3", says="moved 10000"),
    "build/bin/tessera-wall --wall 1x1 --window --scene tests/data/scenes/yard.tsct &": Row(
        "", elsewhere="run-wall --window; the line below it is run on a wall without one"),
    "tessera-ctl --server ADDR:PORT status": asked("ctl status", says="frame"),
    "tessera-ctl --server … status": asked("ctl status"),
    "tessera-ctl status": asked("ctl status"),
    "tessera-ctl types": Row("Asked", "tessera-ctl types", says="Geometry"),
    "tessera-ctl types --json": Row("Asked", "tessera-ctl types --json", says="schema"),
    "tessera-ctl requests": Row("Asked", "tessera-ctl requests", says="LoadFile"),
    "tessera-ctl requests --json": Row("Asked", "tessera-ctl requests --json", says="stays_open"),
    "tessera-ctl requests --proto > proto/application.proto": Row(
        "Asked", "tessera-ctl requests --proto", says="RequestHead"),
    "tessera-ctl budget": asked("ctl budget"),
    "tessera-ctl bookmark N": asked("ctl bookmark 3 --keep && ctl bookmark 3", says="bookmark 3 is here"),
    "tessera-ctl exposure": asked("ctl exposure", says="exposure"),
    "tessera-ctl exposure off --tone-map agx": asked("ctl exposure off --tone-map agx", says="agx"),
    "tessera-ctl contacts": asked("ctl contacts"),
    "tessera-ctl --server ADDR:PORT contacts": asked("ctl contacts"),
    "tessera-ctl get NODE bounds": asked("ctl get /carriage bounds && ctl get / bounds", says="large"),
    "tessera-ctl get": asked("ctl get /carriage", says="translation"),
    "tessera-ctl set": asked("ctl set /carriage translation -2 0.5 1"),
    "tessera-ctl load": asked("ctl load $PWD/tests/data/outside/crane.tsct", options="--allow $PWD/tests/data",
                              says="loaded"),
    "tessera-ctl load --at --scale --fit --up": asked(
        "ctl load $PWD/tests/data/outside/crane.tsct --at 1 0 2 --scale 2 --up y && ctl load "
        "$PWD/tests/data/outside/crane.tsct --fit 2", options="--allow $PWD/tests/data", says="loaded"),
    "tessera-ctl loads": asked("ctl loads", says="no file"),
    "tessera-ctl cancel": asked("ctl cancel 7 2>&1 || [ $? = 3 ]", says="no load 7"),
    "tessera-ctl files": asked("ctl files && ctl files $PWD/tests/data/outside", options="--allow $PWD/tests/data",
                               says="crane.tsct"),
    "tessera-ctl --server ADDR:PORT load --reload FILE": asked(
        "ctl load $PWD/tests/data/outside/crane.tsct && ctl load --reload $PWD/tests/data/outside/crane.tsct",
        options="--allow $PWD/tests/data", says="took"),
    "tessera-ctl save": asked("ctl save $T/now.tsc && tessera-check $T/now.tsc", leaves=("$T/now.tsc",)),
    "tessera-ctl save FILE.glb --under NODE": asked(
        "ctl save $T/now.glb --still && tessera-check $T/now.glb", leaves=("$T/now.glb",)),
    "tessera-ctl --server ADDR:PORT save FILE.glb": asked(
        "ctl save $T/all.glb && tessera-check $T/all.glb", leaves=("$T/all.glb",)),
    "tessera-ctl save FILE.tsct": asked(
        "ctl save $T/now.tsct && ls $T/now.*.arrays && tessera-check $T/now.tsct", leaves=("$T/now.tsct",)),
    "tessera-ctl --server ADDR:PORT save FILE.tsc": asked(
        "ctl save $T/now.tsc && ctl save $T/now.tsct && tessera-check $T/now.tsc $T/now.tsct",
        leaves=("$T/now.tsc", "$T/now.tsct")),
    "tessera-ctl snapshot": asked("ctl snapshot $T/now.png", leaves=("$T/now.png",)),
    "tessera-ctl --server ADDR:PORT snapshot now.png": asked("cd $T && ctl snapshot now.png", leaves=("$T/now.png",)),
    "tessera-ctl show": asked("ctl show test-picture && ctl show scene"),
    "tessera-ctl show test-picture [--count]": asked("ctl show test-picture --count && ctl show scene"),
    "tessera-ctl --server ADDR:PORT show test-picture": asked("ctl show test-picture && ctl show scene"),
    "tessera-ctl view": asked("ctl view --scale 1.5"),
    "tessera-ctl view --reset": asked("ctl view --reset"),
    "tessera-ctl view --head me 0.2 1.6 0.7": asked("ctl view --head viewer 0.2 1.6 0.7"),
    "tessera-ctl navigate walk": asked("ctl navigate walk"),
    "tessera-ctl animations": asked("ctl animations", says="/drive"),
    "tessera-ctl inlines": asked("ctl inlines"),
    "tessera-ctl find EXPRESSION": asked("ctl find //ball", says="/row"),
    "tessera-ctl clone NODE [--deep] [--share TYPE|NODE]": asked(
        "ctl clone /post && ctl clone /post --deep --share Material"),
    "tessera-ctl set NODE points@17 x y z": asked(
        "ctl set /cube/skin/surface points@3 -0.6 0.5 0.5 || ctl set /cube/skin points@3 -0.6 0.5 0.5", scene=SURFACE),
    "tessera-ctl play|pause|seek|speed NODE": asked("ctl pause /drive && ctl seek /drive 99 && ctl play /drive",
                                                    says="stopped at 1 s: 99 s is beyond its end, 1 s"),
    "tessera-ctl trackers": asked("ctl trackers"),
    "tessera-ctl --server ADDR:PORT trackers": asked("ctl trackers"),
    "tessera-ctl whoami": asked('ctl whoami && ctl --token-file "$(grep -l "server $WALL" '
                                '$XDG_RUNTIME_DIR/tessera/*.wall)" whoami', says="operator of the wall"),
    "tessera-ctl people": asked("ctl people", says="operator"),
    "tessera-ctl top": asked("ctl top --every 0.2", says="HOST"),
    "tessera-ctl watch": asked("ctl watch --seconds 0.2"),
    "tessera-ctl trace out/trace.json --frames 300": asked("ctl trace $T/trace.json --frames 3", says="3 frames of",
                                                           leaves=("$T/trace.json",)),
    "tessera-ctl view --by --position 0 0 -1": asked("ctl view --by --position 0 0 -1", says="stands at"),
    "tessera-ctl steps": asked("ctl move /post 1 0 0 && ctl steps", says="undo  sets Transform.translation of /post"),
    "tessera-ctl link": asked("ctl link", says="/?token="),
    "tessera-ctl link --role viewer": asked("ctl link --role viewer", says="/?token="),
    "tessera-ctl link --role editor": asked("ctl link --role editor", says="/?token="),
    "tessera-ctl link --role ROLE": Row("", elsewhere="link --role viewer"),
    "tessera-ctl measure FROM TO": asked("ctl measure 0,9,0 /post && ctl measure 0,0,0 3,4,0", says="/post"),
    "tessera-ctl pick --wand NAME": asked("ctl pick --wand right", code=3, says="right"),
    "tessera-ctl play-tracker 127.0.0.1:5000": Row("Asked", "tessera-ctl play-tracker 127.0.0.1:$PORT --seconds 0.1"),
    "tessera-ctl play-tracker HOST:PORT": Row("Asked", "tessera-ctl play-tracker 127.0.0.1:$PORT --seconds 0.1"),
    "tessera-ctl fly": Row("Asked", "ctl fly", YARD, draws=True, keys="w\x1b[Aq\x03"),
    "tessera-ctl --server ADDR:PORT fly": Row("Asked", "ctl fly", YARD, draws=True, keys="w\x1b[Aq\x03"),
    "tessera-ctl seek": asked("ctl seek /drive -1", says="stopped at 0 s"),
    "tessera-ctl move /hall/trolley 5 0 0 --by": asked("ctl move /carriage 0.1 0 0 --by", says="carriage"),
    "tessera-ctl drag": asked("ctl drag 32 18 40 18 || [ $? = 3 ]", scene="deploy/scenes/gallery/60-manipulators.tsct"),
    "tessera-deform --server ADDR:PORT bend:20:4:/NODE": asked(
        "tessera-deform --server $WALL bend:20:4:/jelly --seconds 0.1", scene=SURFACE),
    "tessera-deform --server ADDR:PORT bend-x:0..28:4:/ring/animal --seconds 8": Row(
        "Slow", "tessera-deform --server $WALL bend-x:0..28:4:/ring/animal --seconds 0.1",
        "deploy/scenes/rearing.tsct"),

    # ------------------------------------------------------------------ of shipped scenes
    "tessera-ctl … set /fountain/core pace 4": Row("Rooms", "ctl set /fountain/core pace 4",
                                                   "deploy/scenes/emitters.tsct"),
    "tessera-ctl … seek /tour/walk 12": Row("Rooms", "ctl seek /tour/walk 12", "deploy/scenes/gallery.tsct",
                                            says="is at 12 s"),
    'tessera-ctl … set "/court/ball 0/geometry" controlPoints@63 0.9 0.6 0.9': Row(
        "Rooms", 'ctl set "/court/ball 0/geometry" controlPoints@63 0.9 0.6 0.9', "deploy/scenes/bent.tsct"),
    "tessera-ctl … set /sign/text text Hello": Row("Rooms", "ctl set /sign/text text Hello",
                                                   "deploy/scenes/letters.tsct"),
    "tessera-ctl … set /knot/field surfaceValue 200": Row("Rooms", "ctl set /knot/field surfaceValue 200",
                                                          "deploy/scenes/volume.tsct"),
    "tessera-ctl … set /church/proxy_group wanted true": Row(
        "Rooms", "ctl set /church/proxy_group wanted true", "deploy/scenes/village/village.tsct"),
    "tessera-ctl … inlines": Row("Rooms", "ctl inlines", "deploy/scenes/village/village.tsct", says="house.tsct"),
    "tessera-ctl … set /house/inline wanted true": Row("Rooms", "ctl set /house/inline wanted true",
                                                       "deploy/scenes/village/village.tsct"),
    "tessera-ctl … set /garden/animal/surface points@158 0.8 3 -0.3": Row(
        "Rooms", "ctl set /garden/animal/surface points@158 0.8 3 -0.3", "deploy/scenes/subdivision.tsct"),
    "tessera-ctl … animations": Row("Rooms", "ctl animations", "deploy/scenes/moving.tsct", says="/crawl"),
    "tessera-ctl --server ADDR:PORT move /hall/trolley 5 0 0 --by": Row(
        "Hall", "ctl move /hall/trolley 5 0 0 --by", HALL),
    # Of a script its first line.
    "tessera-server --wall 2x2 --scene deploy/scenes/engine-hall.tsct --assets /usr/share/assimp/models \\": Row(
        "Hall", says="was stopped by /hall/right row/machine", leaves=("$T/stops.png",),
        changes=(("--size 1600x900", "--size 64x36 --rate 5"), ("127.0.0.1:7000", "127.0.0.1:$PORT"),
                 ("--output out", "--output $T/out"), ("deploy/scenes/engine-stops.png", "$T/stops.png"))),
    "build/bin/example-mover ADDR:PORT /carriage paced 600": Row(
        "Rooms", "out/bin/example-mover $WALL /carriage paced 5", "tests/data/scenes/yard.tsct"),
    "build/bin/example-carousel ADDR:PORT /fair/hub": Row("Rooms", "out/bin/example-carousel $WALL /fair/hub 0.02",
                                                          "deploy/examples/carousel/carousel.tsct"),

    # ------------------------------------------------------------------ servers and hosts by hand
    "tessera-server … --record show.tsr": Row("ByHand",
                                              f"cd $T && by_hand --record show.tsr && tessera-replay show.tsr",
                                              says="the same"),
    "tessera-server --record FILE": Row("", elsewhere="README.md has the whole line"),
    "tessera-wall --record FILE": Row("ByHand",
                                      "tessera-wall --wall 1x1 --size 64x36 --scene tests/data/scenes/yard.tsct "
                                      "--frames 3 --output $T --record $T/w.tsr && tessera-replay $T/w.tsr",
                                      says="the same"),
    # A wall that has begun knows its scene; a folder without one does not.
    "tessera-wall --journal": Row(
        "ByHand", ""
                  "tessera-wall --wall 1x1 --scene tests/data/scenes/yard.tsct --journal $T/j --frames 2 --size 64x36 "
                  "--output $T && "
                  "tessera-wall --wall 1x1 --journal $T/j --frames 2 --size 64x36 --output $T",
                  leaves=("$T/wall.png",)),
    "tessera-server --wall wall.wall --scene hall.tsct --listen 0.0.0.0:7000": Row("ByHand", "by_hand", says="over"),
    "tessera-client --server master:7000 --host upper-left": Row("ByHand", "by_hand", says="over"),
    "tessera-server --wall 2x2 --scene hall.tsct --listen 127.0.0.1:7000 --threads 4 --record hall.rec": Row(
        "ByHand", "cd $T && by_hand --threads 4 --record hall.rec && tessera-replay hall.rec --threads 1 && "
                  "tessera-replay hall.rec --contacts >contacts.jsonl", says="the same", leaves=("$T/contacts.jsonl",)),
    "tessera-replay hall.rec --threads 1": Row("", elsewhere="with the line before it"),
    "tessera-replay hall.rec --contacts > contacts.jsonl": Row("", elsewhere="with the line before it"),
    "tessera-replay FILE [--threads N] [--frames N] [--json] [--contacts]": Row(
        "ByHand", "by_hand --record $T/f.rec && tessera-replay $T/f.rec --threads 2 --frames 2 --json",
        says='"frames"'),
    "tessera-server --wall wall.wall --scene hall.tsct --listen 0.0.0.0:7000 --keys keys --journal /var/lib/wall": Row(
        "ByHand", f"{KEYS} && export HOST_OPTIONS='--keys keys' && by_hand --keys keys --journal journal && by_hand "
                  f"--keys keys --journal journal", says="goes on"),
    "tessera-server --journal DIR": Row("", elsewhere="deploy/README.md has the whole line"),
    "tessera-server --wall wall.wall --scene hall.tsct --assets /srv/models --listen 0.0.0.0:7000 --keys keys": Row(
        "ByHand", f"{KEYS} && HOST_OPTIONS='--keys keys' by_hand --keys keys --assets /usr/share/assimp/models",
        says="over"),
    "tessera-client --server master:7000 --host upper-left --keys keys-of-upper-left --output /var/lib/tessera": Row(
        "ByHand", f"{KEYS} && tessera-keys renew all --out for-all && HOST_OPTIONS='--keys for-all --output $T/host' "
                  f"by_hand --keys keys", says="over"),
    # ------------------------------------------------------------------ keys
    "tessera-keys init --wall wall.wall && tessera-keys host upper-left --out keys-of-upper-left": keys(
        "tessera-keys host upper-left --out out && ls out", says="host-upper-left.pem"),
    "tessera-keys init --wall my.wall": keys("ls keys", says="authority.pem"),
    "tessera-keys host upper-left --out for-upper-left": keys(
        "tessera-keys host upper-left --out for && ls for", says="authority.crt"),
    "tessera-keys person ada --role editor --out ada": keys("tessera-keys person ada --role editor --out ada && ls ada",
                                                            says="person-ada.pem"),
    "tessera-keys person ada --role editor": keys("tessera-keys person ada --role editor && tessera-keys list",
                                                  says="editor"),
    "tessera-keys host NAME": keys("tessera-keys host left && tessera-keys list", says="left"),
    "tessera-keys revoke NAME": keys("tessera-keys host left && tessera-keys revoke left && tessera-keys list",
                                     says="revoked"),
    "tessera-keys revoke --links": keys("tessera-keys token ci --role editor && tessera-keys revoke --links && "
                                        "tessera-keys list", says="revoked 1 token"),
    "tessera-keys token ci --role editor --hours 8": keys(
        "tessera-keys token ci --role editor --hours 8 && tessera-keys list", says="token"),
    "tessera-keys token visitor --panel FILE": keys(
        "tessera-keys token visitor --panel $OLDPWD/deploy/scenes/engine-hall.panel && tessera-keys list",
        says="panel"),
    "tessera-server --panel FILE": Row("ByHand", "by_hand --panel $ROOT/deploy/scenes/engine-hall.panel",
                                       says="hall.panel: http://"),
    "tessera-server --panel hall.panel ...": Row("", elsewhere="the line above"),
    "tessera-keys token visitor --panel hall.panel": Row("", elsewhere="deploy/security.md has the same line"),
    "tessera-keys token NAME --panel FILE": Row("", elsewhere="deploy/security.md has the same line"),
    "tessera-check --scene hall.tsct hall.panel": Row(
        "Files", "tessera-check --scene deploy/scenes/engine-hall.tsct --assets /usr/share/assimp/models "
                 "deploy/scenes/engine-hall.panel", says="a panel of 7 controls"),
    "tessera-keys revoke ci": keys("tessera-keys token ci --role editor && tessera-keys revoke ci",
                                   says="revoked 1 token"),
    "tessera-keys token": Row("", elsewhere="the beginning of a line"),
    "tessera-keys person": Row("", elsewhere="the beginning of a line"),
    "tessera-keys list": keys("tessera-keys list", says="server"),
    "tessera-keys renew": keys("tessera-keys renew", says="30 days"),
    "tessera-keys [--keys DIR] VERB": keys("tessera-keys --keys keys authority -", says="BEGIN CERTIFICATE"),
    "tessera-server --wall my.wall --scene hall.tsct --listen 0.0.0.0:7000 --keys keys": Row(
        "ByHand", f"{KEYS} && HOST_OPTIONS='--keys keys' by_hand --keys keys", says="over"),
    "tessera-client --server master:7000 --host upper-left --keys for-upper-left": Row(
        "", elsewhere="with the line before it"),
    "tessera-ctl --keys DIR": Row("", elsewhere="integration.WallByKeys"),
    "tessera-client --keys DIR": Row("", elsewhere="integration.WallByKeys"),
    "tessera-server --listen": Row("", elsewhere="the beginning of a line"),
    "tessera-keys init": Row("", elsewhere="the beginning of a line"),
    "tessera-ctl --server master:7000 --keys ada status": Row("", elsewhere="integration.WallByKeys"),
    "tessera-server --no-input": Row("ByHand", "by_hand --no-input", says="over"),
    "tessera-server --no-notices": Row("ByHand", "by_hand --no-notices", says="over"),
    "tessera-server --allow DIR…": Row("ByHand", "by_hand --allow $T /usr/share", says="over"),
    "tessera-client --surface none": Row("ByHand", "HOST_OPTIONS='--surface none' by_hand", says="over"),
    "tessera-client --check": Row("ByHand", "tessera-client --check", says="surface"),
    "tessera-wall --start": SSH,
    "tessera-wall --start --wall my.wall --scene hall.tsct": SSH,
    "tessera-wall --start --wall my.wall --test-picture": SSH,
    "tessera-wall --start --wall my.wall --scene hall.tsct --restart --output out": SSH,
    "tessera-wall --test-picture": Row("ByHand", "tessera-wall --test-picture --size 64x36 --frames 2 --output $T",
                                       leaves=("$T/wall.png",)),
    "tessera-wall --outputs": Row("ByHand",
                                  "tessera-wall --wall deploy/screens/stereo.wall --test-picture --frames 2 --output "
                                  "$T --outputs", leaves=("$T/outputs/front-0-0-left.png",)),
    "tessera-wall --wall my.wall --scene hall.tsct --outputs": Row(
        "ByHand", f"{MY_WALL} && tessera-wall --wall $T/my.wall --size 160x40 --scene tests/data/scenes/yard.tsct "
                  f"--frames 2 --output $T/out --outputs", leaves=("$T/out/outputs/desk-0-0.png",)),
    "tessera-wall --wall 1x1 --size 960x540 --frames 20": Row(
        "ByHand", "tessera-wall --wall 1x1 --size 96x54 --frames 2 --scene tests/data/scenes/yard.tsct --output $T",
        leaves=("$T/wall.png",)),
    "./deploy/run-wall --wall deploy/screens/stereo.wall --frames 3 --outputs": Row(
        "Options", "./deploy/run-wall --no-install --wall deploy/screens/stereo.wall --frames 2 --size 64x36 --outputs",
        leaves=("out/outputs/front-0-0-left.png",)),

    "tessera-wall --scene field.ply --up z --fit 3 --at 0 1 -1 --point-radius 0.02": Row(
        "ByHand", "tests/commands/made field $T/field.ply && tessera-wall --wall 1x1 --size 64x36 --frames 2 --output "
                  "$T --scene $T/field.ply --up z --fit 3 --at 0 1 -1 --point-radius 0.02", leaves=("$T/wall.png",)),

    # ------------------------------------------------------------------ on a desktop
    "./deploy/run-wall --window": Row("Desk",
                                      "./deploy/run-wall --no-install --window --size 160x90 --frames 2 --scene "
                                      "tests/data/scenes/yard.tsct", display=True, leaves=("out/report.json",)),
    "tessera-client --window": Row("Desk", "HOST_OPTIONS=--window by_hand", display=True, says="over"),
    "tessera-client … --window HDMI-0 1 --full-screen": Row("Desk", "HOST_OPTIONS='--window 0 --full-screen' by_hand",
                                                            display=True, says="over"),
    "tessera-client … --surface egl --device 0": Row("Desk", "HOST_OPTIONS='--surface egl --device 0' by_hand",
                                                     says="over"),
    "tessera-window --monitors": Row("Desk", display=True, says="0:"),
    "tessera-wall --wall 2x2 --test-picture --window": Row("Desk",
                                                           "tessera-wall --wall 2x2 --test-picture --window --size "
                                                           "160x90 --frames 2 --output $T", display=True,
                                                           leaves=("$T/wall.png",)),
    "tessera-wall --window": Row("Desk",
                                 "tessera-wall --wall 1x1 --scene tests/data/scenes/yard.tsct --window --size 64x36 "
                                 "--frames 2 --output $T", display=True, leaves=("$T/wall.png",)),
    "tessera-server --wall my.wall --test-picture --listen 127.0.0.1:7000 &": Row(
        "Desk", f"{MY_WALL} && tessera-server --wall $T/my.wall --size 160x40 --test-picture --listen 127.0.0.1:$PORT "
                f"--frames 3 & tessera-client --server 127.0.0.1:$PORT --host here --window; wait", display=True,
                says="over"),
    "tessera-client --server 127.0.0.1:7000 --host here --window DP-1 DP-2 --full-screen --vsync": Row(
        "", elsewhere="with the line before it, on one monitor; --vsync needs a monitor's driver"),
    "tessera-client --check --window DP-1 --surface egl --device 1": Row(
        "Desk", "tessera-client --check --window 0 --surface egl --device 0", display=True),
    "build/bin/tessera-wall --wall 1x1 --window --scene deploy/examples/carousel/carousel.tsct &": Row(
        "Desk", "tessera-wall --wall 1x1 --window --scene deploy/examples/carousel/carousel.tsct --size 64x36 "
                "--frames 2 --output $T", display=True, leaves=("$T/wall.png",)),

    # ------------------------------------------------------------------ files
    "tessera-check --schema": file("tessera-check --schema", says="Saved.Object"),
    "tessera-convert IN OUT": file("tessera-convert tests/data/scenes/yard.tsct $T/yard.tsc", leaves=("$T/yard.tsc",)),
    "tessera-convert IN OUT.glb": file("tessera-convert tests/data/scenes/yard.tsct $T/yard.glb && "
                                       "tessera-check $T/yard.glb", leaves=("$T/yard.glb",)),
    "tessera-convert IN OUT.glb --under NODE": file(
        "tessera-convert tests/data/models/stall.gltf $T/roof.glb --under /stall/stall/roof && "
        "tessera-check $T/roof.glb",
        leaves=("$T/roof.glb",)),
    "tessera-convert IN OUT.tsct": file("tessera-convert "
                                        "/usr/share/assimp/models/glTF2/BoxTextured-glTF-Binary/BoxTextured.glb "
                                        "$T/box.tsct && tessera-check $T/box.tsct", leaves=("$T/box.tsct",)),
    "tessera-convert --optimise": file("tessera-convert --optimise tests/data/scenes/yard.tsct $T/yard.tsc",
                                       leaves=("$T/yard.tsc",)),
    "tessera-convert --optimise IN OUT.tsc": file(
        "tessera-convert --optimise tests/data/scenes/yard.tsct $T/yard.tsc && tessera-check $T/yard.tsc",
        leaves=("$T/yard.tsc",)),
    "tessera-convert --optimise --steps merge": file(
        "tessera-convert --optimise --steps merge tests/data/scenes/yard.tsct $T/merged.tsc",
        leaves=("$T/merged.tsc",)),
    "tessera-convert IN.mpcdi OUT.wall": file(
        "tests/commands/made mpcdi $T/in.mpcdi && tessera-convert $T/in.mpcdi $T/out.wall && tessera-check $T/out.wall",
        leaves=("$T/out.wall",)),
    "tessera-convert calibration.mpcdi my.wall": file(
        "cd $T && $ROOT/tests/commands/made mpcdi calibration.mpcdi && tessera-convert calibration.mpcdi my.wall",
        leaves=("$T/my.wall",)),
    "tessera-convert IN OUT.wall": file(
        "tessera-convert tests/data/walls/room.xml $T/out.wall && tessera-check $T/out.wall", leaves=("$T/out.wall",)),
    "tessera-convert hall.ndisplay hall.wall": file(
        "tessera-convert tests/data/walls/room.ndisplay $T/hall.wall && tessera-check $T/hall.wall",
        leaves=("$T/hall.wall",)),
    "tessera-check hall.wall": file(
        "tessera-convert tests/data/walls/room.json $T/hall.wall && tessera-check $T/hall.wall"),
    "tessera-wall --wall hall.wall --test-picture --window": Row(
        "Desk", "tessera-convert tests/data/walls/two-by-two.json $T/hall.wall && tessera-wall --wall $T/hall.wall "
        "--test-picture --window --size 160x90 --frames 2 --output $T", display=True, leaves=("$T/wall.png",)),
    "tessera-ctl new-wall FILE.wall": Row("", elsewhere="asks at a terminal: python.other_walls answers"),
    "tessera-ctl new-wall my.wall": Row("", elsewhere="asks at a terminal: python.other_walls answers"),
    "tessera-ctl new-wall my.wall --columns 2 --rows 2 --size 55 --bezel 3.5 --distance 2.5": file(
        "cd $T && tessera-ctl new-wall my.wall --columns 2 --rows 2 --size 55 --bezel 3.5 --distance 2.5 && "
        "tessera-check my.wall", says="see it in windows", leaves=("$T/my.wall",)),
    "tessera-check --formats": file("tessera-check --formats && tessera-check --formats --json", says="KHR_draco"),
    "tessera-check --machine": file("tessera-check --machine; test $? -le 1", says="reading files"),
    "tessera-check FILE…": file("tessera-check tests/data/scenes/yard.tsct deploy/walls/2x2.wall"),
    "tessera-check FILE.wall": file("tessera-check deploy/walls/2x2.wall"),
    "tessera-check my.wall": file(f"{MY_WALL} && tessera-check $T/my.wall"),
    "tessera-collide A.obj B.stl --poses poses.txt --query all --json": file(
        "tests/commands/made boxes $T && cd $T && tessera-collide A.obj B.stl --poses poses.txt --query all --json",
        says='"hit"'),
    "tessera-collide A B --poses FILE --query any|all|distance|toi|depth": file(
        "tests/commands/made boxes $T && cd $T && for q in any all distance depth; do tessera-collide A.obj B.stl "
        "--poses poses.txt --query $q; done && tessera-collide A.obj B.stl --poses ways.txt --query toi"),
    "tessera-collide A B --poses FILE --query any --realignment planes|table --time": file(
        "tests/commands/made boxes $T && cd $T && for r in planes table; do tessera-collide A.obj B.stl --poses "
        "poses.txt --query any --realignment $r --time; done", says="boxes tested"),
    "tessera-collide A --query ray --poses RAYS": file(
        "tests/commands/made boxes $T && cd $T && echo '0.5 0.4 9 0 0 -1' >rays.txt && tessera-collide A.obj --query "
        "ray --poses rays.txt", says="at t = 8"),
    "tessera-collide --as-a spherical-bezier": file(
        "tests/commands/made boxes $T && cd $T && tessera-collide A.obj B.stl --poses poses.txt --query all --as-a "
        "spherical-bezier --as-b spherical-bezier"),
    "tessera-collide --as-a bezier": file(
        "tests/commands/made boxes $T && cd $T && tessera-collide A.obj B.stl --poses poses.txt --query any --as-a "
        "bezier && tessera-collide A.obj A.obj --poses poses.txt --query distance --as-a bezier --as-b subdivision",
        says="at least"),
    "tessera-collide A.obj --query self": file(
        "tests/commands/made boxes $T && cd $T && tessera-collide A.obj --query self"),
    "tessera-collide A B --import-memory MIB": file(
        "tests/commands/made boxes $T && cd $T && tessera-collide A.obj B.stl --poses poses.txt --query all "
        "--import-memory 512"),
    "tessera-collide A --query self": file("tests/commands/made boxes $T && cd $T && tessera-collide A.obj --query "
                                           "self"),
    # Of a script its first line.
    "at() { awk -v d=$1 'BEGIN { for (i = 0; i < 500; i++) print d*cos(i), d*sin(i)*cos(2*i), d*sin(i)*sin(2*i),": Row(
        "Files", needs=("scan/stanford_bun_zipper.ply",), says="mean",
        changes=(("i < 500", "i < 5"), ("at 0.5 >far", "cd $T; at 0.5 >far"),
                 ("BUNNY BUNNY", "$DATA/scan/stanford_bun_zipper.ply $DATA/scan/stanford_bun_zipper.ply"))),
    "tessera-evaluate bishop.obj --at places.txt --json": file(
        "tests/commands/made boxes $T && cd $T && tessera-evaluate A.obj --at places.txt --json", says='"point"'),
    "tessera-evaluate blades.obj --scheme nurbs --at places.txt": file(
        "tests/commands/made boxes $T && cd $T && tessera-evaluate patch.obj --scheme nurbs --at places.txt"),
    "tessera-evaluate SURFACE --nearest FILE [--tolerance T]": file(
        "tests/commands/made boxes $T && cd $T && echo '3 0.5 0.5' >near.txt && tessera-evaluate A.obj --nearest "
        "near.txt --tolerance 1e-4 && tessera-evaluate patch.obj --scheme nurbs --nearest near.txt", says="distance"),
    "tessera-evaluate SURFACE --at FILE [--scheme catmull-clark|loop|nurbs|bilinear] [--json]": file(
        "tests/commands/made boxes $T && cd $T && for s in catmull-clark bilinear; do tessera-evaluate A.obj --at "
        "places.txt --scheme $s; done && tessera-evaluate triangles.obj --at places.txt --scheme loop --json"),
}

# Of benchmarks in --real: as little as they can, where the line does not say how much.
LITTLE = {
    **{name: "--quick" for name in ("collision", "realignment", "spherical", "deforming", "freeform", "neighbours",
                                    "ray", "pipeline", "scene")},
    "cull": "--frames 1", "drawing": "--frames 1", "sorting": "--frames 1", "screen": "--frames 4",
    "load": "--quick --nodes 10000", "follow": "--edits 4", "rules": "--edits 4", "blender": "--moves 20 --rows few",
}

# What no document shows as a line: what was installed, and the options of `./deploy/run-wall --help` that no line above
# uses. Together they use each once.
MORE_LINES = [
    ("Installed", "./deploy/install --no-install $T/prefix && tests/commands/check-installed $T/prefix",
     ("$T/prefix/share/tessera/LICENSE",)),
    ("Options", "./deploy/run-wall --no-install --scene tests/data/scenes/yard.tsct --wall 1x1 --size 64x36 --frames "
                "2 --samples 1 --budget 500 --camera /camera/camera --culler frustum "
                "--surface osmesa --anisotropy 2 --gl-memory 300 --share off --output $T/a "
                "--assets /usr/share/assimp/models --record $T/yard.tsr --threads 2 --keep-frames "
                "--listen 127.0.0.1:$PORT --no-input --no-notices --restart "
                "--allow-unconfined-import --import-memory 4096 --insecure",
     ("$T/a/wall.png", "$T/a/report.json", "$T/yard.tsr")),
    ("Options", "./deploy/run-wall --no-install --scene tests/data/usd/cart.usda --wall 1x1 --size 64x36 --frames "
                "2 --journal $T/journal --surface egl --device 0 --output $T/b --variant /Cart:load=none "
                "--up z --at 0 1 0 --fit 3 --point-radius 0.01 --verbose --audit $T/audit.log --uploads $T/uploads "
                "--uploads-mib 10 --reload", ("$T/b/wall.png", "$T/journal")),
    # No host of this wall names a machine, so that no ssh is called.
    ("Options", "./deploy/run-wall --no-install --wall 1x1 --size 64x36 --frames 2 --test-picture --start "
                "--start-anyway --ssh /bin/false --output $T/c", ("$T/c/wall.png",)),
    ("Options", "./deploy/run-wall --no-install --version && ./deploy/run-wall --no-install --completion bash "
                ">$T/words && tessera-keys --keys $T/keys init --wall 1x1 && "
                "./deploy/run-wall --no-install --wall 1x1 --size 64x36 --frames 2 --test-picture --keys $T/keys "
                "--output $T/d", ("$T/d/wall.png",)),
]
