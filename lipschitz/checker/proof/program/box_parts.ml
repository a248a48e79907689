(* Proofs by parts of a box, or of boxes that hold a multiple of every (x, 1): the tree of a certificate
   as a proof of the theorems, with the numbers that only have to be good guesses, in floating point. *)

open Refusal
open Json

(* Numbers that a proof may hold, as in the other checkers. *)
let most_inputs_of_a_corner = 48
let deepest = 2000
let largest_input = 0x1p100
let on_at_corner = 0x1p-30

type domain = Box of Proved.box | Everywhere
type found = domain * (unit -> Proved.proof) * (unit -> string)

(* Guesses. None of them can make a false claim accepted. *)

let slope_between low high =
  let l = Proposal.to_float low and u = Proposal.to_float high in
  let slope = u /. (u -. l) in
  if Float.is_finite slope && slope > 0. then Exact.of_float (Float.min 1. slope) else Exact.one

(* No less, in 64 bits. *)
let rounded_up (m, e) =
  let excess = Z.numbits m - 64 in
  if excess <= 0 then m, e else Z.add (Z.shift_right m excess) Z.one, Z.add e (Z.of_int excess)

(* A guesser for one matrix after the other: the candidates of the one at hand, and how many were asked for before
   it. *)
type guesses = { mutable rest : Proved.factor Seq.t; mutable matrices : int; mutable is_shown : bool }
(* Rows of the theorems' matrices end where only zeros follow. *)
let padded matrix =
  let size = List.fold_left max (List.length matrix) (List.mapi (fun i row -> i + List.length row) matrix) in
  let row i given = given @ List.init (size - i - List.length given) (fun _ -> Exact.zero) in
  List.init size (fun i -> row i (match List.nth_opt matrix i with Some given -> given | None -> []))
let next_factor guesses k matrix =
  if k = 0 then begin
    guesses.rest <- Proposal.factors (padded matrix);
    guesses.matrices <- guesses.matrices + 1;
  end;
  match guesses.rest () with
  | Seq.Nil -> guesses.is_shown <- false; None
  | Seq.Cons (factor, rest) -> guesses.rest <- rest; guesses.is_shown <- true; Some factor
let new_guesses () = { rest = Seq.empty; matrices = 0; is_shown = false }

(* For each layer before layer `top`, the last one first, which neurons are on at a point. *)
let slopes_at (layers : Weights.layer list) top point =
  let rec go k h found = function
    | (layer : Weights.layer) :: rest when k < top ->
      let y = Array.mapi (fun i row ->
          let bias = layer.biases.(i) in
          let y = ref bias and size = ref (Float.abs bias) in
          Array.iteri (fun j w -> let term = w *. h.(j) in y := !y +. term; size := !size +. Float.abs term) row;
          !y, !size) layer.weights in
      let is_on = Array.to_list (Array.map (fun (y, size) -> y > on_at_corner *. size) y) in
      go (k + 1) (Array.map (fun (y, _) -> Float.max 0. y) y) (is_on :: found) rest
    | _ -> found in
  go 0 point [] layers

(* Reading *)

let box_of (net : Network.t) certificate part where =
  let box = find where part (find where "box" certificate) in
  let ends key = Exact.hex_floats where (find where key box) in
  let lower = ends "lower" and upper = ends "upper" in
  require (List.length lower = Functions.inputs net part && List.length upper = List.length lower)
    "%s: the box has another size" where;
  let clamped side = if Network.is_clamped part && net.clamp <> [] then
      List.map2 (fun x (a, b) -> Float.min (Float.max x a) b) side net.clamp else side in
  let low = clamped lower and high = clamped upper in
  require (List.for_all2 ( <= ) low high) "%s: the box is empty" where;
  require (List.for_all (fun x -> Float.abs x <= largest_input) (low @ high))
    "%s: the box is empty, too large or of another size" where;
  List.combine (List.map Exact.of_float lower) (List.map Exact.of_float upper), Array.of_list low, Array.of_list high

let hex_words where json = List.map Exact.parse_hex_float (Exact.words (text where json))

(* One word of a tree: a letter, and its number or its decision. *)
type word = Split of int | Multipliers of int | Form of int | Of_rho | Decided of int * bool * int
let word_of text =
  let size = String.length text in
  let number from until =
    let digits = String.sub text from (until - from) in
    if digits <> "" && String.length digits <= 15 && String.for_all (fun c -> c >= '0' && c <= '9') digits
    then int_of_string_opt ("0u" ^ digits) else None in
  if size = 0 then None else
  match text.[0] with
  | 'r' when size = 1 -> Some Of_rho
  | 's' -> Option.map (fun k -> Split k) (number 1 size)
  | 't' -> Option.map (fun k -> Multipliers k) (number 1 size)
  | 'q' -> Option.map (fun k -> Form k) (number 1 size)
  | 'd' ->
    (match List.find_opt (fun sign -> String.contains text sign) [ '+'; '-' ] with
     | None -> None
     | Some sign ->
       let at = String.index text sign in
       match number 1 at, number (at + 1) size with
       | Some neuron, Some corner -> Some (Decided (neuron, sign = '+', corner))
       | _ -> None)
  | _ -> None

let rec place neuron layer = function
  | size :: rest -> if neuron < size then Some (layer, neuron) else place (neuron - size) (layer + 1) rest
  | [] -> None

(* Pairs of neurons that are not in some states at once: "3+ 17- <lambda> <multiplier>". *)
let conflicts_of where sizes json =
  let neuron word =
    let size = String.length word in
    let digits = if size > 0 then String.sub word 0 (size - 1) else "" in
    require (digits <> "" && size <= 10 && String.for_all (fun c -> c >= '0' && c <= '9') digits
             && (word.[size - 1] = '+' || word.[size - 1] = '-'))
      "%s: a conflict's neuron is not a number with + or -" where;
    int_of_string ("0u" ^ digits), word.[size - 1] = '+' in
  let rec read = function
    | [] -> []
    | first :: second :: lambda :: multiplier :: rest ->
      let i, first_on = neuron first and j, second_on = neuron second in
      let lambda = Exact.parse_hex_float lambda and multiplier = Exact.parse_hex_float multiplier in
      let fails () = rejected "%s: a conflict is not between two neurons, or its lambda not in [0, 1]" where in
      let at neuron stays_on = match place neuron 0 sizes with
        | Some (in_layer, in_row) -> { Proved.in_layer; in_row; stays_on } | None -> fails () in
      if not (i < j && 0. <= lambda && lambda <= 1.) then fails ();
      let weight = Exact.of_float lambda in
      { Proved.first = at i first_on; second = at j second_on; weight; rest = Proved.add0 Exact.one (Proved.neg weight);
        times_product = Exact.of_float multiplier } :: read rest
    | _ -> rejected "%s: a conflict lacks words" where in
  read (Exact.words (text where json))

(* Layers of which the last input is multiplied by the biases, and is the last output of all but the last layer. *)
let homogeneous (layers : Weights.layer list) =
  let count = List.length layers in
  List.mapi (fun k (layer : Weights.layer) ->
      let wide = Array.mapi (fun i row -> Array.append row [| layer.biases.(i) |]) layer.weights in
      let last = Array.make (Weights.inputs layer) 0. in
      let weights = if k + 1 < count then Array.append wide [| Array.append last [| 1. |] |] else wide in
      { layer with weights; biases = Array.map (fun _ -> 0.) weights }) layers

(* Their boxes, as `all_faces` of the theorems. *)
let all_faces radius =
  let n = Array.length radius in
  let low = Array.append (Array.map Float.neg radius) [| 0. |] and high = Array.append radius [| 1. |] in
  let face k side =
    let at ends = let ends = Array.copy ends in ends.(k) <- side; ends in
    at low, at high in
  face n 1. :: List.concat_map (fun k -> [ face k (-. radius.(k)); face k radius.(k) ]) (List.init n Fun.id)

let sizes_of layers = List.map Weights.outputs layers
let hidden (w : Weights.t) = List.filteri (fun k _ -> k + 1 < List.length w.layers) w.layers

let point corner low high = Array.mapi (fun k l -> if (corner lsr k) land 1 = 1 then high.(k) else l) low

(* By layer, in the order in which they were read. *)
let by_layer count found =
  let found = List.rev found in
  List.init count (fun k -> List.filter_map (fun (layer, d) -> if layer = k then Some d else None) found)
let decided found count = if found = [] then [] else by_layer count found

(* Words of a tree, and where they fail. *)
type reader = { where : string; words : string array; mutable at : int }
let reader where text =
  { where; words = (if text = "" then [||] else Array.of_list (String.split_on_char ' ' text)); at = 0 }
let fails reader at reason = rejected "%s: word %d of the tree: %s" reader.where (at + 1) reason
let next reader =
  if reader.at >= Array.length reader.words then rejected "%s: the tree ends before the box is covered" reader.where;
  match word_of reader.words.(reader.at) with
  | Some word -> reader.at <- reader.at + 1; word
  | None -> fails reader reader.at "neither a split nor a leaf, a form or a decision"
let ends reader =
  if reader.at < Array.length reader.words then fails reader reader.at "the box is covered already"

let middle_of reader here k low high ~pending ~boxes =
  if pending > deepest + boxes then fails reader here "the tree is too deep";
  if k >= Array.length low then fails reader here "there is no such coordinate";
  let middle = low.(k) +. (high.(k) -. low.(k)) /. 2. in
  if not (low.(k) <= middle && middle <= high.(k)) then fails reader here "the side cannot be halved";
  middle
let with_middle side k middle = let side = Array.copy side in side.(k) <- middle; side

(* The tree of each box, and the number of the word of each leaf. `passes`: neurons that pass their input on. *)
let trees_of ~where ~(layers : Weights.layer list) ~passes ~multipliers ~boxes text =
  let reader = reader where text in
  let leaves = ref [] and sizes = sizes_of layers and count = List.length layers in
  let rec tree pending low high found =
    let word = next reader in
    let here = reader.at - 1 in
    match word with
    | Of_rho | Form _ -> fails reader here "there is no rho"
    | Decided (neuron, is_on, corner) ->
      (match place neuron 0 sizes with
       | None -> fails reader here "a neuron is decided, but the decision is not used"
       | Some place when Array.length low > most_inputs_of_a_corner || passes place ->
         fails reader here "a neuron is not decided by its slopes"
       | Some (layer, neuron) ->
         let lower_slopes = slopes_at layers layer (point corner low high) in
         tree pending low high ((layer, { Proved.neuron; is_on; lower_slopes }) :: found))
    | Multipliers k ->
      if k >= Array.length multipliers then fails reader here "there are no such multipliers";
      leaves := (here + 1) :: !leaves;
      let conflicts, t = multipliers.(k) in
      Proved.Leaf (decided found count, conflicts, t)
    | Split k ->
      let middle = middle_of reader here k low high ~pending ~boxes:(List.length boxes) in
      let lower = tree (pending + 1) low (with_middle high k middle) [] in
      let upper = tree pending (with_middle low k middle) high [] in
      Proved.Halve (decided found count, k, Exact.of_float middle, lower, upper) in
  let last = List.length boxes - 1 in
  let trees = List.mapi (fun k (low, high) -> tree (last - k) low high []) boxes in
  ends reader;
  trees, Array.of_list (List.rev !leaves)

(* |drho|^2 <= dv' Q dv. *)
let form_of net rho where json =
  require_keys where [ "q"; "t"; "factor" ] json;
  let weights = Functions.weights net rho in
  let q = List.map (hex_words where) (list where (find where "q" json)) in
  require (List.length q = Functions.inputs net rho) "%s: q has another size" where;
  List.iteri (fun k row -> require (List.length row = k + 1) "%s: q is not a lower triangle" where) q;
  let t = Exact.hex_floats where (find where "t" json) in
  let neurons =
    List.fold_left (fun n l -> n + Weights.outputs l) (- Weights.outputs (Weights.last_layer weights)) weights.layers in
  require (List.length t = neurons && List.for_all (fun x -> x >= 0.) t)
    "%s: needs one nonnegative t per hidden neuron" where;
  let form_factor = match find where "factor" json with
    | Null -> next_factor (new_guesses ())
    | factor ->
      let factor = Exact.factor (where ^ ".factor") factor in
      fun k _ -> if k = 0 then Some factor else None in
  let form = { Proved.lower_rows = List.map (List.map Exact.of_float) q;
               form_multipliers = List.map Exact.of_float t; form_factor } in
  let part = List.nth (Functions.parts net) (Functions.index net rho) in
  require (Proved.check_form part form) "%s: the factor does not show that the matrix inequality holds" where;
  form

(* rho of a proof, which the bound's square must reach. *)
let rho_of where json ~upper =
  let rho = Exact.hex_float where (find where "rho" json) in
  require (rho > 0. && Proved.at_most (Exact.of_float rho) (Proved.mul0 upper upper)) "%s: claims less than sqrt(rho)"
    where;
  rho
let check_range where rho ~moves ~scale =
  require (0x1p-400 <= rho && rho <= 0x1p400) "%s: rho is not positive, or out of range" where;
  let moving = List.filteri (fun k _ -> List.nth moves k) scale in
  require (List.for_all (fun w -> 0x1p-200 <= w && w <= 0x1p200) moving) "%s: scale is out of range" where

(* Conflicts and the multipliers, as many as there are neurons, that a leaf may name. *)
let multipliers_of where json sizes =
  let lists = list where (find where "multipliers" json) in
  let conflicts = if has "conflicts" json then list where (find where "conflicts" json) else [] in
  require (not (has "conflicts" json) || List.length conflicts = List.length lists)
    "%s: there are conflicts for other multipliers" where;
  let conflicts =
    if has "conflicts" json then List.map (conflicts_of where sizes) conflicts else List.map (fun _ -> []) lists in
  let neurons = List.fold_left (+) 0 sizes in
  Array.of_list (List.map2 (fun conflicts some ->
      let t = hex_words where some in
      require (List.length t = neurons && List.for_all (fun x -> x >= 0.) t)
        "%s: multipliers are not one nonnegative number per hidden neuron" where;
      conflicts, List.map Exact.of_float t) conflicts lists)

(* Hints for a proof, and the reason where they do not show it. `leaves`: the number of the word of each. *)
let hints_of where leaves =
  let guesses = new_guesses () in
  let reason () =
    let k = guesses.matrices in
    if k > 0 && not guesses.is_shown then
      Printf.sprintf "%s: word %d of the tree: its multipliers do not show the bound there" where leaves.(k - 1)
    else
      Printf.sprintf "%s: the tree does not prove the bound after leaf %d: a neuron is not decided by its slopes"
        where k in
  { Proved.slope_between; rounded_up; factor_number = next_factor guesses }, reason

(* `bound`'s proof; its box and what proves the bound there. *)
let read (net : Network.t) certificate bound ~where ~names ~moves ~scale ~upper : found =
  let json = find where "proof" bound and here = where ^ ".proof" in
  let is_global = find where "domain" bound = Text "global" in
  require_keys here ([ "rho"; "form"; "tree"; "multipliers" ] @ (if is_global then [ "radius" ] else [])
    @ if has "conflicts" json then [ "conflicts" ] else []) json;
  let moved = List.hd names in
  require (not (Functions.starts_with "rho:" moved)) "%s: rho has no box" where;
  let rho = rho_of where json ~upper in
  let exact_rho = Exact.of_float rho in
  let tree_text = text where (find where "tree" json) in
  let weights = Functions.weights net moved in
  require (List.length weights.layers > 1) "%s: no hidden layer" where;
  let form_json = find where "form" json in
  require ((form_json = Null) = (List.length names = 1))
    "%s: a form must be given for set functions, and only for them" where;
  let radius = if is_global then begin
      let radius = Exact.hex_floats where (find where "radius" json) in
      require (List.length radius = Functions.inputs net moved && List.for_all (fun r -> r > 0.) radius)
        "%s: needs a positive radius per input" where;
      require (List.for_all (fun r -> r <= largest_input) radius)
        "%s: the box is empty, too large or of another size" where;
      radius
    end else [] in
  let domain, boxes = if is_global then Everywhere, all_faces (Array.of_list radius)
    else let box, low, high = box_of net certificate moved where in Box box, [ low, high ] in
  let hidden = hidden weights in
  let layers = if is_global then homogeneous hidden else hidden in
  let passes (layer, neuron) =
    is_global && layer + 1 < List.length hidden && neuron = Weights.outputs (List.nth hidden layer) in
  let multipliers = multipliers_of where json (sizes_of layers) in
  check_range where rho ~moves ~scale;
  let trees, leaves = trees_of ~where ~layers ~passes ~multipliers ~boxes tree_text in
  let form = match names with [ _; name ] -> Some (form_of net name (where ^ ".form") form_json) | _ -> None in
  let hints, reason = hints_of where leaves in
  let proof () = match domain, trees with
    | Box _, [ tree ] -> Proved.By_parts (exact_rho, form, hints, tree)
    | _ -> By_all_parts (exact_rho, form, hints, List.map Exact.of_float radius, trees) in
  domain, proof, reason
