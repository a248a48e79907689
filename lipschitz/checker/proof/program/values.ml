(* Ranges, jumps and float32 errors over a box, as claims of the theorems: of each network by its layers, then of their
   sum. *)

open Refusal
open Json

let texts where ~size json =
  let values = List.map (fun word -> Exact.of_float (Exact.parse_hex_float word)) (Exact.words (text where json)) in
  require (List.length values = size) "%s: needs one number per output" where;
  values

(* What is stated of a layer or a sum: intervals, and errors ([] where nothing is said of float32). *)
let stated where ~size ~with_error json =
  require_keys where [ "lower"; "upper"; "error" ] json;
  let error = find where "error" json in
  require ((error <> Null) = with_error) "%s: an error must be given if there are input errors, and only then" where;
  let lower = texts where ~size (find where "lower" json) in
  let upper = texts where ~size (find where "upper" json) in
  List.combine lower upper, if with_error then texts where ~size error else []

(* The layers of a network in order; the last one by itself. *)
let layers where (weights : Weights.t) ~with_error json =
  let entries = list where json in
  require (List.length entries = List.length weights.layers) "%s: needs one entry per layer" where;
  let of_layer layer entry = stated where ~size:(Weights.outputs layer) ~with_error entry in
  let all = List.map2 of_layer weights.layers entries in
  match List.rev all with last :: hidden -> List.rev hidden, last | [] -> assert false

let leaves where = where ^ ": the values leave the bounds"
let too_little where = where ^ ": claims less than the float32 error"

(* Of a network for inputs in `box`, computed with errors of at most `errors`, entry by entry; `norm`: of its error. *)
let prove_network (state : Claims.t) where p ~box ~errors ~with_error ~norm (hidden, (last, last_error)) =
  Claims.prove state (Within (p, box, last)) (By_layers (List.map fst hidden)) (leaves where);
  if with_error then
    Claims.prove state (Float_error (p, box, errors, last_error, norm))
      (By_roundings (List.map fst hidden, List.map snd hidden)) (too_little where)

(* At least the norm of these numbers. *)
let sum_of numbers = List.fold_left Claims.plus Exact.zero numbers

(* What reaches the first layer: a box, and errors. The theorems apply the clamp themselves. *)
let input_box (state : Claims.t) where name entry =
  let box = match find where "domain" entry with
    | Text "box" -> Witness.box where state.json name
    | Text "clamp" when state.net.clamp <> [] && Network.is_clamped name -> state.net.clamp
    | _ -> rejected "%s: the domain is neither the box nor a clamp of this input" where in
  List.map (fun (low, high) -> Exact.of_float low, Exact.of_float high) box
let input (state : Claims.t) where name entry =
  let box = input_box state where name entry in
  match find where "input_error" entry with
  | Null -> box, []
  | all ->
    let errors = Exact.hex_floats where (find where name all) in
    require (List.length errors = List.length box && List.for_all (fun e -> e >= 0.) errors)
      "%s: needs one input error per input, none negative" where;
    box, List.map Exact.of_float errors

let optional where entry key ~given =
  let decimal = find where key entry and hex = find where (key ^ "_hex") entry in
  require ((decimal <> Null) = given && (hex <> Null) = given)
    "%s: %s must be given where it has a meaning, and only there" where key;
  if given then Some (Exact.of_float (Exact.number (where ^ " " ^ key) decimal hex)) else None

let keys = [ "function"; "neighbours"; "domain"; "input_error"; "networks"; "sum"; "lower"; "upper"; "jump"; "jump_hex";
             "float32_error"; "float32_error_hex" ]

(* Of the largest absolute values. *)
let sum_of_squares values =
  sum_of (List.map (fun i -> let a = Proved.largest_abs i in Claims.times a a) values)

let check_jump (state : Claims.t) where phi ~box ~values rho jump =
  let reason = where ^ ": claims less than the jump" in
  let slope = match Hashtbl.find_opt state.uppers (rho, "all", []) with
    | Some (slope, Claims.Proved_here) -> slope
    | _ -> rejected "%s: rests on a bound of %s that is missing" where (shown rho) in
  require (Claims.at_most (Claims.times (Claims.times slope slope) (sum_of_squares values)) (Claims.times jump jump))
    "%s" reason;
  Claims.prove state (Jump_at_most (phi, box, Functions.index state.net rho, jump)) Proved.By_norm reason

(* Exact intervals of the layers of part p over a box, proved; those of the last one. *)
let prove_exact (state : Claims.t) where p box =
  let part = Proved.part_at state.parts p in
  let through (found, box, between) layer =
    let bounds = Proved.affine_ends layer box in
    let activation, behind = match between with a :: rest -> a, rest | [] -> Proved.Relu, [] in
    bounds :: found, Proved.activated_ends activation bounds, behind in
  let hidden, input, _ =
    List.fold_left through ([], Proved.clamp_ends part.clamp box, part.between) part.hidden in
  let last = Proved.affine_ends part.outer input in
  Claims.prove state (Within (p, box, last)) (By_layers (List.rev hidden)) (leaves where);
  last

(* One neighbour that makes or ends a composition in which the function is silent: the values beside those. *)
let check_step (state : Claims.t) where entry ~silent phi rho jump =
  let names = Array.of_list (List.map fst state.net.parts) in
  let compositions = Proved.beside silent phi in
  let here = List.sort_uniq compare (phi :: List.concat compositions) in
  let boxes = List.map (fun p -> p, input_box state where names.(p) entry) here in
  List.iter (fun (p, box) -> ignore (prove_exact state where p box)) boxes;
  let size = Proved.inputs_of (Proved.part_at state.parts rho) in
  let sum_of composition =
    match Option.bind (Proved.terms_of boxes composition) (Proved.sum_ends state.accepted size) with
    | Some sum -> sum | None -> rejected "%s: no range of a term" where in
  let sums = List.map sum_of compositions in
  let reason = where ^ ": claims less than the step to neighbours for which the network is silent" in
  List.iter (fun sum ->
      let values = prove_exact state where rho sum in
      let square = sum_of_squares values in
      require (Claims.at_most square (Claims.times jump jump)) "%s" reason) sums;
  Claims.prove state (Step_at_most (silent, boxes, phi, rho, jump)) (Proved.By_steps sums) reason

let check (state : Claims.t) entry =
  require_keys "values" keys entry;
  let f = text "values" (find "values" "function" entry) in
  let where = "values of " ^ shown f and names = Functions.networks_of f in
  let is_set = List.length names = 2 in
  require (if is_set then List.hd names <> "phi:ground" else f = "network")
    "%s: possible only for the network, or for a sum over neighbours" where;
  let count = match find where "neighbours" entry with
    | Number { value; is_integer = true } when Float.abs value <= 1e15 -> int_of_float value
    | _ -> rejected "%s: neighbours is not an integer" where in
  require (if is_set then 1 <= count && count <= Claims.most_neighbours else count = 0)
    "%s: impossible number of neighbours" where;
  let inputs = List.hd names :: if is_set && Functions.has_ground state.net then [ "phi:ground" ] else [] in
  let rho = List.tl names in
  let weights name = Functions.weights state.net name in
  let networks = find where "networks" entry in
  require (List.length (members where networks) = List.length (inputs @ rho))
    "%s: networks does not list the networks of the function" where;
  let with_error = find where "input_error" entry <> Null in
  if with_error then begin
    require (List.length (members where (find where "input_error" entry)) = List.length inputs)
      "%s: input_error is not of the function's inputs" where;
    require (List.for_all (fun name -> (weights name).precision = "float32") (inputs @ rho))
      "%s: a float32 error of weights that are not float32" where;
    require (List.for_all (Functions.is_relu state.net) (inputs @ rho))
      "%s: a float32 error of a network with activations other than ReLU" where
  end;
  let bounds name = layers (where ^ ": " ^ name) (weights name) ~with_error (find where name networks) in
  let numbers key = List.map Exact.of_float (Exact.hex_floats where (find where key entry)) in
  let lower = numbers "lower" and upper = numbers "upper" in
  let outer = weights (List.nth names (List.length names - 1)) in
  let outputs = Weights.outputs (Weights.last_layer outer) in
  require (List.length lower = outputs && List.length upper = outputs) "%s: the values leave the range" where;
  let range = List.combine lower upper in
  let jump = optional where entry "jump" ~given:is_set in
  let norm = Option.value ~default:Exact.zero (optional where entry "float32_error" ~given:with_error) in
  let sum = find where "sum" entry in
  require ((sum <> Null) = is_set) "%s: a sum must be given for set functions, and only for them" where;
  (match rho with
   | [] ->
     let p = Functions.index state.net f in
     let box, errors = input state where f entry in
     let hidden, (last, last_error) = bounds f in
     prove_network state where p ~box ~errors ~with_error ~norm (hidden, (last, last_error));
     (* The range may be wider than what is stated of the last layer. *)
     Claims.prove state (Within (p, box, range)) (By_layers (List.map fst hidden))
       (where ^ ": the values leave the range");
     require (Proved.contains range last) "%s: the values leave the range" where
   | rho :: _ ->
     let term name =
       let p = Functions.index state.net name in
       let box, errors = input state where name entry in
       let hidden, (last, last_error) = bounds name in
       prove_network state (where ^ ": " ^ name) p ~box ~errors ~with_error ~norm:(sum_of last_error)
         (hidden, (last, last_error));
       let fewest, most = if name = "phi:ground" then 1, 1 else 0, count in
       { Proved.phi = p; inputs_in = box; fewest = Z.of_int fewest; most = Z.of_int most }, errors, last in
     let terms = List.map term inputs in
     let r = Functions.index state.net rho in
     let size = Functions.inputs state.net rho in
     let sums, sum_errors = stated (where ^ ": sum") ~size ~with_error sum in
     let last = bounds rho in
     prove_network state (where ^ ": " ^ rho) r ~box:sums ~errors:sum_errors ~with_error ~norm last;
     let silent = Functions.silent state.net rho and summed = List.map (fun (t, _, _) -> t) terms in
     let zeros = List.map (fun _ -> Exact.zero, Exact.zero) range in
     require (not (Proved.may_be_silent silent summed) || Proved.contains range zeros)
       "%s: the range lacks 0, the output for neighbours for which the network is silent" where;
     Claims.prove state (Sum_within (silent, summed, r, range)) (Proved.By_sum sums)
       (where ^ ": the values leave the range");
     let first, _, values = List.hd terms in
     let jump = Option.get jump in
     check_jump state where first.phi ~box:first.inputs_in ~values rho jump;
     if silent <> [] then check_step state where entry ~silent first.phi r jump;
     if with_error then
       Claims.prove state (Sum_float_error (List.map (fun (t, errors, _) -> t, errors) terms, r, norm))
         (Proved.By_rounded_sum (sums, sum_errors)) (too_little where));
  state.values <- state.values + 1
