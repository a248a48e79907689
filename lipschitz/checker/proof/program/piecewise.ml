(* Piecewise linear activations of files that state none, written with ReLU as the same functions: leaky_relu(x) is
   relu(x) - a relu(-x), relu6(x) is relu(x) - relu(x - 6), hardtanh(x) is -1 + relu(x + 1) - relu(x - 1). *)

open Enclosed

(* constant + the sum of factor within(scale x + shift). *)
type term = { scale : float; shift : float; factor : float }
type t = { terms : term list; constant : float; within : Proved.activation }

let itself = { scale = 1.; shift = 0.; factor = 1. }
let is_itself activation = activation.terms = [ itself ]

(* A decimal as it stands in C++'s from_chars. *)
let slope text =
  let is_digit c = String.contains "0123456789.eE+-" c in
  let is_decimal = text <> "" && text.[0] <> '+' && String.for_all is_digit text in
  match if is_decimal then float_of_string_opt text else None with
  | Some x when Float.abs x <= 1e6 -> Some x | _ -> None
let leaky slope = { terms = [ itself; { scale = -1.; shift = 0.; factor = -. slope } ]; constant = 0.; within = Relu }
let that_is within = { terms = [ itself ]; constant = 0.; within }
let called name = match name, Activation.called name with
  | _, Some within -> Some (that_is within)
  | "relu6", None -> Some { (leaky 0.) with terms = [ itself; { scale = 1.; shift = -6.; factor = -1. } ] }
  | "hardtanh", None ->
    let terms = [ { itself with shift = 1. }; { scale = 1.; shift = -1.; factor = -1. } ] in
    Some { terms; constant = -1.; within = Relu }
  | "leaky_relu", None -> Some (leaky 0.01)
  | _, None ->
    let prefix = "leaky_relu:" in
    let n = String.length prefix in
    if not (Tensor.starts_with prefix name) then None
    else Option.map leaky (slope (String.sub name n (String.length name - n)))

let map_of (layer : Weights.layer) =
  let row numbers = Onnx_operators.row_of_numbers (Array.length numbers) (fun k -> exactly numbers.(k)) in
  { Folding.inputs = Weights.inputs layer; rows = Array.map row layer.weights;
    shifts = Array.map exactly layer.biases }

let activated chain (map : Folding.map) activation name =
  if activation.within <> Proved.Relu then fst (Folding.activated chain activation.within name map [])
  else begin
    let argument term =
      Folding.shifted (Folding.scaled map (fun _ -> exactly term.scale)) (fun _ -> exactly term.shift) in
    let rectified, _ = Folding.relu chain name (Folding.stacked (List.map argument activation.terms)) [] in
    let n = Folding.size map in
    let part k term =
      Folding.scaled (Folding.selected rectified (Array.init n (fun i -> k * n + i))) (fun _ -> exactly term.factor) in
    let parts = List.mapi part activation.terms in
    let sum = List.fold_left (fun sum part -> Folding.sum sum part) (List.hd parts) (List.tl parts) in
    Folding.shifted sum (fun _ -> exactly activation.constant)
  end

(* A network, the activations `within` of which are known, with these between its layers. *)
let written (w : Weights.t) stated =
  let count = List.length w.layers - 1 in
  let between = match stated with [ one ] -> List.init count (fun _ -> one) | several -> several in
  let chain = Folding.start (Weights.inputs (Weights.first_layer w)) in
  let step (map, name) ((layer : Weights.layer), activation) =
    Folding.composed (map_of layer) (activated chain map activation name), layer.name in
  let first = Weights.first_layer w in
  match
    let last, name = List.fold_left step (map_of first, first.name) (List.combine (List.tl w.layers) between) in
    Folding.finished chain name last
  with
  | layers, activations ->
    let of_folded (layer : Folding.layer) =
      { Weights.name = layer.name; weights = Folding.rows_of layer; biases = Folding.biases_of layer } in
    let is_float32 = w.precision = "float32" && List.for_all Folding.holds_float32 layers in
    { w with layers = List.map of_folded layers; activations = Some activations;
             precision = if is_float32 then "float32" else "float64" }
  | exception Folding.Too_large what -> Refusal.bad_input "%s: %s; certify a smaller network" w.path what
  | exception Not_finite -> Refusal.bad_input "%s: weights, or what they fold into, are not finite" w.path
