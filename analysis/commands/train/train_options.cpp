#include "analysis/commands/train/train_options.h"

#include "analysis/cli/command_line.h"

namespace swarmcert::analysis {
namespace {

void declare_data(CLI::App& app, TrainOptions& options) {
  app.add_option("--quantity", options.quantity,
                 "force_z, force (x, y, z) or torque (x, y, z; needs logs of at least 400 Hz)")
      ->check(CLI::IsMember({"force_z", "force", "torque"}))
      ->capture_default_str();
  app.add_option("--test", options.test, "Flights that only test; without it every fifth flight does");
  app.add_option("--select", options.select,
                 "Flights that only decide when training ends; without it every fifth flight does");
  app.add_option("--split", options.split,
                 "How FLIGHTS are held back if --select or --test name none: whole flights, or blocks of 2 s "
                 "of each (auto: blocks if there are too few flights)")
      ->check(CLI::IsMember({"auto", "flights", "blocks"}))
      ->capture_default_str();
}

void declare_limits_of_training(CLI::App& app, TrainOptions& options) {
  app.add_option("--gamma", options.run.trainer.gamma.value, "Limit of the spectral norms")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--gamma-scope", options.gamma_scope,
                 "Whether gamma limits every layer's norm, or the product over a network's layers")
      ->check(CLI::IsMember({"layer", "network"}))
      ->capture_default_str();
  app.add_option("--gamma-mode", options.gamma_mode, "clip: at most the limit; equal: always the limit")
      ->check(CLI::IsMember({"clip", "equal"}))
      ->capture_default_str();
  app.add_option(
         "--layers", options.layers,
         "free: any weights, scaled back to their limits after each step; aol, orthogonal, sandwich: weights "
         "that keep them by construction (not with --gamma-mode equal). With a tight --max-lipschitz these "
         "give smaller errors than free; choose among them by the selecting flights")
      ->check(CLI::IsMember({"free", "aol", "orthogonal", "sandwich"}))
      ->capture_default_str();
  app.add_option("--max-lipschitz", options.run.max_lipschitz,
                 "Limit of the joint Lipschitz bounds in gf (torque: mN m) per unit of input, proved; layers "
                 "that reach it are clipped below gamma")
      ->check(CLI::PositiveNumber);
}

void declare_samples(CLI::App& app, TrainOptions& options) {
  app.add_option("--weights", options.weights,
                 "Scenarios and the compositions of kinds in them count the same (scenarios), or the same "
                 "relative to their own errors (errors)")
      ->check(CLI::IsMember({"scenarios", "errors"}))
      ->capture_default_str();
  app.add_option("--symmetry", options.symmetry,
                 "vertical: every epoch rotates every sample about the vertical and mirrors it, including "
                 "its force or torque; none: samples as recorded")
      ->check(CLI::IsMember({"vertical", "none"}))
      ->capture_default_str();
}

void declare_layers(CLI::App& app, TrainOptions& options) {
  app.add_option("--phi", options.sizes.phi, "Hidden layers of phi")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--rho", options.sizes.rho, "Hidden layers of rho")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--features", options.sizes.features, "Width between phi and rho")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_flag("--no-ground", options.no_ground, "Leave out the phi of the own state");
}

void declare_run(CLI::App& app, TrainOptions& options) {
  app.add_flag("--allow-worse", options.allow_worse,
               "Keep each kind's output as trained; by default, outputs are scaled down to suit the "
               "selecting flights (not with --gamma-mode equal), and compositions that are worse with "
               "the network than without get none: network.toml lists them as silent");
  app.add_option("--epochs", options.run.epochs, "Maximum number of epochs")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--patience", options.run.patience, "Epochs without improvement after which training stops")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--rate", options.run.trainer.learning_rate, "Initial learning rate")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--batch", options.run.trainer.batch, "Samples per step")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--seed", options.run.trainer.seed, "Seed of the initial weights and of the sample order")
      ->capture_default_str();
  app.add_option("--teachers", options.teachers,
                 "First train this many networks, with the seeds after --seed, then train one network "
                 "on their averaged predictions (distillation); the one with the smallest error on the "
                 "selecting flights is written")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option(
         "--folds", options.folds,
         "Divide all flights but the test flights into this many folds, train one network without each "
         "fold, which selects its epoch, and write their mean as one network, this many times as wide; the "
         "outputs of each network on its unseen fold replace selecting flights: they decide the scale of the "
         "outputs and the compositions without a network")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  leave_out_of_record(
      app.add_flag("--resume", options.run.resumes, "Go on with an interrupted run in the same folder"));
  app.add_flag("--published-filter", options.flights.published_filter,
               "Cut and filter as the networks' authors did, see compare");
  app.add_flag("--published-signals", options.flights.published_signals,
               "Only the thrust lag, masses and unfiltered accelerometer of --published-filter");
  add_output(app, "--report", options.report, "Write an HTML report into this folder");
}

}  // namespace

void declare_train_options(CLI::App& app, TrainOptions& options) {
  options.run.trainer.gamma.value = 3;
  declare_flights(app, options.flights, true);
  add_output(app, "-o,--output", options.output, "Folder for networks, certificate and models")->required();
  declare_data(app, options);
  declare_limits_of_training(app, options);
  declare_samples(app, options);
  declare_layers(app, options);
  declare_run(app, options);
}

}  // namespace swarmcert::analysis
