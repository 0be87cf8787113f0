/// tessera-replay: makes a recording's frames again.
#include "server/tools/replay/ReplayCommand.h"

int main(int argc, char** argv) {
    return tessera::runReplay({argv + 1, argv + argc});
}
