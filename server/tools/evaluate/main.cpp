/// tessera-evaluate: points of smooth surfaces.
#include "server/tools/evaluate/EvaluateCommand.h"

int main(int argc, char** argv) {
    return tessera::runEvaluate({argv + 1, argv + argc});
}
