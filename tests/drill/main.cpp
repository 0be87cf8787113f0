/// tessera-drill: does to walls of real processes what happens to walls, and says what it cost the others.
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "common/options/Options.h"
#include "tests/drill/DrillTable.h"
#include "tests/drill/Guest.h"
#include "tests/integration/Process.h"

namespace {

using namespace tessera::drill;

struct Arguments {
    std::vector<std::string> rows;
    std::string json;
    std::vector<std::string> guest;
    DrillOptions drill;
};

std::vector<Row> allRows(const DrillOptions& options) {
    std::vector<Row> all;
    for (std::vector<Row> some :
         {hostRows(), serverRows(), strangerRows(), crowdRows(), linkRows(), applicationRows(options)})
        std::ranges::move(some, std::back_inserter(all));
    return all;
}

int drill(const Arguments& arguments) {
    std::vector<Row> rows = allRows(arguments.drill);
    for (const std::string& wanted : arguments.rows)
        if (std::ranges::find(rows, wanted, &Row::name) == rows.end()) {
            std::string names;
            for (const Row& row : rows) names += " " + row.name;
            fmt::print(stderr, "tessera-drill: no row is called '{}'; there are:{}\n", wanted, names);
            return 2;
        }
    DrillTable table;
    DrillTable::printHead();
    for (const Row& row : rows)
        if (arguments.rows.empty() || std::ranges::find(arguments.rows, row.name) != arguments.rows.end())
            table.run(row, arguments.drill);
    table.printEnd();
    if (!arguments.json.empty() && !table.writeJson(arguments.json)) {
        fmt::print(stderr, "tessera-drill: cannot write {}: is the folder there?\n", arguments.json);
        return 1;
    }
    return table.broken() == 0 ? 0 : 1;
}

pid_t child = -1;

/// The drill runs in a child; its processes end with it, and here its files are removed, however it ended.
int supervise(const Arguments& arguments) {
    const tessera::test::TemporaryFolder files;
    setenv("TMPDIR", files.path().c_str(), 1);
    const pid_t self = getpid();
    child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != self) _exit(1);
        std::exit(drill(arguments));
    }
    if (child < 0) return 1;
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) signal(number, [](int) { kill(child, SIGKILL); });
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    tessera::Options options(
        "tessera-drill",
        "Kills, stops, cuts, floods and starves walls of real processes on this\nmachine; a table of what the others "
        "missed. Exit code 1: a promise was not kept.");
    options.option("--rows", arguments.rows, "Only these").typeName("NAME,...").delimiter(',');
    options.option("--json", arguments.json, "Write the rows here too").typeName("FILE");
    options.option("--repetitions", arguments.drill.repetitions, "Of rows that take little time (3)")
        .typeName("N")
        .range(1, 100);
    options.option("--nodes", arguments.drill.nodes, "In the scene (100000)").typeName("N").range(1'000, 1'000'000);
    options.option("--seconds", arguments.drill.seconds, "That a crowd stands around (60)")
        .typeName("S")
        .range(1, 3'600);
    options.flag("--large", arguments.drill.large, "A million nodes to load and to join");
    options.option("--guest", arguments.guest).expected(2).hidden();  // the drill's own children
    if (const std::optional<int> code = options.parse(argc, argv)) return *code;
    if (arguments.guest.size() == 2) return runGuest(arguments.guest[0], arguments.guest[1]);
    return supervise(arguments);
}
