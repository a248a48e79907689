(* A network as its weight file holds it, every weight exactly. *)

open Refusal

type layer = { name : string; weights : float array array; (* rows *) biases : float array }
type t = {
  path : string;
  sha256 : string;
  precision : string;
  layers : layer list;
  activations : Proved.activation list option;  (* of each layer but the last; None: not stated *)
}

let outputs layer = Array.length layer.weights
let inputs layer = Array.length layer.weights.(0)
let first_layer w = List.hd w.layers
let last_layer w = List.nth w.layers (List.length w.layers - 1)
(* ReLU where nothing is stated. *)
let between w = Option.value w.activations ~default:(List.map (fun _ -> Proved.Relu) (List.tl w.layers))
let is_relu w = List.for_all (( = ) Proved.Relu) (between w)

(* Weights 1 and biases 0 behind the last layer, under a name that is free; with an order, number i is number order.(i)
   of what is in front. *)
let with_identity ?order w =
  let size = outputs (last_layer w) and numbered = Printf.sprintf "layer%d" (List.length w.layers + 1) in
  let rec free name = if List.exists (fun l -> l.name = name) w.layers then free (numbered ^ "_" ^ name) else name in
  let taken i = match order with Some order -> order.(i) | None -> i in
  let row i = Array.init size (fun j -> if taken i = j then 1. else 0.) in
  { w with layers = w.layers @ [ { name = free numbered; weights = Array.init size row;
                                   biases = Array.make size 0. } ] }

(* What is stated: one for all, one for each layer but the last, or one more, which an identity layer follows. None: it
   fits neither the layers nor what is stated already. *)
let with_activations w stated =
  let count = List.length w.layers in
  let stated = match stated with [ one ] -> List.init (count - 1) (fun _ -> one) | several -> several in
  let rec fit stated layers = match stated, layers with
    | [], _ -> true
    | a :: stated, layer :: layers -> outputs layer mod Activation.group a = 0 && fit stated layers
    | _ :: _, [] -> false in
  if w.activations <> None && count > 1 then
    (if Option.map (List.map Proved.base) w.activations = Some stated then Some w else None)
  else if List.length stated < count - 1 || not (fit stated w.layers) then None
  else
    let w = if List.length stated = count then with_identity w else w in
    Some { w with activations = Some stated }

(* Every number rounded to the nearest float32. *)
let as_float32 w =
  let round x =
    let y = Exact.float32 x in
    if not (Float.is_finite y) then bad_input "%s: a number is beyond the range of float32" w.path;
    y in
  let rounded l = { l with weights = Array.map (Array.map round) l.weights; biases = Array.map round l.biases } in
  { w with precision = "float32"; layers = List.map rounded w.layers }

(* "<layer>.<part>" or just "<part>". *)
let layer_of part tensor =
  if tensor = part then Some ""
  else match String.rindex_opt tensor '.' with
    | Some dot when String.sub tensor (dot + 1) (String.length tensor - dot - 1) = part ->
        Some (String.sub tensor 0 dot)
    | _ -> None

(* A chain of linear layers of what a file holds, `listing` being what the order of the tensors in it means. A file that
   states the order of evaluation states ReLU unless its reader says more. *)
let assemble ~path ~sha256 listing ~order tensors =
  let refuse t what = bad_input "%s: %s: %s" path (shown t.Tensor.tensor) what in
  if List.length tensors > 4096 then bad_input "%s: holds more than 4096 tensors" path;
  let tensors, are_float32 = Parametrized.effective path tensors in
  let check t =
    if not (Tensor.is_float t.Tensor.kind) then refuse t "weights must be float16, bfloat16, float32 or float64";
    if List.exists (fun n -> n <= 0) t.shape then refuse t "has a dimension of size 0";
    if Tensor.count t.shape > Tensor.most_numbers then refuse t "has too many numbers" in
  List.iter check tensors;
  let names = List.map (fun t -> t.Tensor.tensor) tensors in
  if List.length (List.sort_uniq compare names) <> List.length names then bad_input "%s: a tensor appears twice" path;
  let of_part part t = Option.map (fun layer -> layer, t) (layer_of part t.Tensor.tensor) in
  let weights = List.filter_map (of_part "weight") tensors and biases = List.filter_map (of_part "bias") tensors in
  if weights = [] then bad_input "%s: holds no tensor named \"<layer>.weight\"" path;
  let kind = (snd (List.hd weights)).kind in
  List.iter (fun t -> if t.Tensor.kind <> kind then refuse t "one file has one type") tensors;
  let precision = if kind <> "float64" && are_float32 then "float32" else "float64" in
  List.iter (fun (_, t) ->
      if List.length t.Tensor.shape <> 2 then refuse t "a linear layer's weight has two dimensions")
      weights;
  let owned t = match layer_of "bias" t.Tensor.tensor with
    | Some layer -> (match List.assoc_opt layer weights with
        | Some w -> if t.shape <> [ List.hd w.shape ] then refuse t "does not fit the weight"; true
        | None -> false)
    | None -> false in
  List.iter (fun t -> match layer_of "weight" t.Tensor.tensor, layer_of "bias" t.tensor with
      | Some _, _ -> ()
      | None, Some layer when not (owned t) ->
        refuse t (Printf.sprintf "is a bias without its weight: %s is missing"
                    (if layer = "" then "weight" else shown layer ^ ".weight"))
      | None, Some _ -> ()
      | None, None -> refuse t "is neither the weight nor the bias of a linear layer") tensors;
  let shapes = List.map (fun (name, t) ->
      { Layer_order.name; outputs = List.nth t.Tensor.shape 0; inputs = List.nth t.Tensor.shape 1 }) weights in
  let finite t = Array.map (fun x -> if not (Float.is_finite x) then refuse t "a number is not finite";
      x) (t.Tensor.numbers ()) in
  let layer { Layer_order.name; inputs; outputs } =
    let flat = finite (List.assoc name weights) in
    { name;
      weights = Array.init outputs (fun i -> Array.sub flat (i * inputs) inputs);
      biases = (match List.assoc_opt name biases with Some t -> finite t | None -> Array.make outputs 0.) } in
  let layers = List.map layer (Layer_order.decide path listing ~stated:order shapes) in
  let relu = List.map (fun _ -> Proved.Relu) (List.tl layers) in
  { path; sha256; precision; layers; activations = if listing = Layer_order.Evaluation then Some relu else None }
