(* A network, every weight exactly. *)

type layer = { name : string; weights : float array array; (* rows *) biases : float array }
type t = {
  file : string;  (* relative to the folder of network.toml, or its name *)
  sha256 : string;
  data_files : (string * string) list;  (* beside that file, with their hashes *)
  precision : string;
  layers : layer list;
  activations : Proved.activation list;  (* of each layer but the last *)
}

let outputs layer = Array.length layer.weights
let inputs layer = Array.length layer.weights.(0)
let first_layer w = List.hd w.layers
let last_layer w = List.nth w.layers (List.length w.layers - 1)
let between w = w.activations
let is_relu w = List.for_all (( = ) Proved.Relu) (between w)
