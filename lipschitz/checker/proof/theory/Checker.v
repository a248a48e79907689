(** The executable checker over dyadic numbers, and what its acceptance means. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Bent Gram.
Import ListNotations.
Open Scope Z_scope.

(** mantissa, exponent. *)
Definition dyadic := (Z * Z)%type.
Definition zero : dyadic := (0, 0).
Definition add (x y : dyadic) : dyadic :=
  let (a, e) := x in let (b, f) := y in
  if a =? 0 then y else if b =? 0 then x
  else if e <=? f then (a + Z.shiftl b (f - e), e) else (Z.shiftl a (e - f) + b, f).
Definition mul (x y : dyadic) : dyadic := (fst x * fst y, snd x + snd y).
Definition neg (x : dyadic) : dyadic := (- fst x, snd x).
Definition abs (x : dyadic) : dyadic := (Z.abs (fst x), snd x).
Definition shift (k : Z) (x : dyadic) : dyadic := (fst x, snd x + k).
Definition is_nonnegative (x : dyadic) : bool := 0 <=? fst x.
Definition is_positive (x : dyadic) : bool := 0 <? fst x.

#[global] Arguments add : simpl never.
#[global] Arguments mul : simpl never.
#[global] Arguments neg : simpl never.
#[global] Arguments abs : simpl never.
#[global] Arguments shift : simpl never.
Definition matrixD := list (list dyadic).

(** R in units of 2^unit, D = diag(2^scales). *)
Record factor := Factor { unit : Z; scales : list Z; rows : list (list Z) }.

Fixpoint shift_row (k : Z) (s : list Z) (row : list dyadic) : list dyadic :=
  match row with [] => [] | x :: row' => shift (k + hd 0 s) x :: shift_row k (tl s) row' end.
Fixpoint congruence (s : list Z) (p : matrixD) : matrixD :=
  match p with [] => [] | row :: p' => shift_row (hd 0 s) s row :: congruence (tl s) p' end.
(** D P D - R R'. *)
Definition remainder (p : matrixD) (f : factor) : matrixD :=
  sum add (congruence (scales f) p) (map (map (fun g => (- g, 2 * unit f))) (gramZ (rows f))).
Definition total (u : list dyadic) : dyadic := fold_right add zero u.
(** Diagonally dominant; debts: what rows above have already taken from the diagonal. *)
Fixpoint dominant (e : matrixD) (debts : list dyadic) : bool :=
  match e with
  | [] => match debts with [] => true | _ => false end
  | row :: e' =>
      let off := map abs (tl row) in
      is_nonnegative (add (hd zero row) (neg (add (hd zero debts) (total off)))) &&
          dominant e' (plus add (tl debts) off)
  end.
Definition shows_nonnegative (p : matrixD) (f : factor) : bool := dominant (remainder p f) [].

(** m m' through integers, over the smallest exponent. *)
Definition lowest (m : matrixD) : Z :=
  fold_right (fun row e => fold_right (fun x e => if snd x <=? e then snd x else e) e row) 0 m.
Definition in_units (e : Z) (x : dyadic) : Z := Z.shiftl (fst x) (snd x - e).
Definition gramD (m : matrixD) : matrixD :=
  let e := lowest m in
  if forallb (forallb (fun x => e <=? snd x)) m
  then map (map (fun g => (g, 2 * e))) (gramZ (map (map (in_units e)) m))
  else gram zero add mul m.
(** rho I - m m'. *)
Definition norm_inequality (rho : dyadic) (m : matrixD) : matrixD :=
  sum add (diagonal zero (map (fun _ => rho) m)) (scale_all mul (-1, 0) (gramD m)).

Fixpoint split (t : list dyadic) (ms : list matrixD) : list (list dyadic) :=
  match ms with [] => [] | m :: ms' => firstn (length m) t :: split (skipn (length m) t) ms' end.
Definition neurons (ms : list matrixD) : nat := fold_right (fun m n => (length m + n)%nat) O ms.

Definition inputs (hidden : list matrixD) (last : matrixD) : nat := length (hd [] (hd last hidden)).
Definition is_zero (x : dyadic) : bool := fst x =? 0.
(** Slopes of one neuron lie between these. *)
Definition rangeD := (dyadic * dyadic)%type.
Definition is_unit_range (r : rangeD) : bool := is_zero (fst r) && is_zero (add (snd r) (-1, 0)).
(** What is known of each hidden layer. *)
Definition relationD := relation dyadic.
Definition is_unit_relation (r : relationD) : bool :=
  match r with Each ranges => forallb is_unit_range ranges | Grouped _ _ => false end.
Definition is_grouped (r : relationD) : bool := match r with Each _ => false | Grouped _ _ => true end.
(** A multiplier for each number; for each group one of its distance, and then for each one of its sum. *)
Definition multipliers_in (r : relationD) (m : matrixD) : nat :=
  match r with Each _ => length m | Grouped n _ => (n + n)%nat end.
Fixpoint multipliers_needed (rs : list relationD) (hidden : list matrixD) : nat :=
  match rs, hidden with
  | r :: rs', m :: hidden' => (multipliers_in r m + multipliers_needed rs' hidden')%nat
  | [], m :: hidden' => (length m + multipliers_needed [] hidden')%nat
  | _, [] => O
  end.
Fixpoint groups_fit (rs : list relationD) (hidden : list matrixD) : bool :=
  match rs, hidden with
  | Grouped n k :: rs', m :: hidden' => (length m =? n * k)%nat && groups_fit rs' hidden'
  | _ :: rs', _ :: hidden' => groups_fit rs' hidden'
  | _, _ => true
  end.
Definition minus_one : dyadic := (-1, 0).
Fixpoint bent_of (rs : list relationD) (hidden : list matrixD) (t : list dyadic) : list bent_layer :=
  match rs, hidden with
  | r :: rs', m :: hidden' =>
      match r with
      | Each ranges => (ranges, firstn (length m) t, m)
      | Grouped n k => (repeat (minus_one, (1, 0)) (n * k), spread k (firstn n t), m)
      end :: bent_of rs' hidden' (skipn (multipliers_in r m) t)
  | _, _ => []
  end.
Fixpoint pins_of (n : nat) (rs : list relationD) (hidden : list matrixD) (t : list dyadic) : list pin :=
  match rs, hidden with
  | r :: rs', m :: hidden' =>
      match r with
      | Each _ => ([], [], length m)
      | Grouped g k => (firstn g (skipn g t), sum_rows zero add minus_one n O g k m, length m)
      end :: pins_of (length m) rs' hidden' (skipn (multipliers_in r m) t)
  | _, _ => []
  end.
(** If all slopes are in [0, 1], the inputs are minimised out. *)
Definition matrix_inequality (rs : list relationD) (hidden : list matrixD) (last : matrixD) (rho : dyadic)
    (t : list dyadic) : matrixD :=
  if forallb is_unit_relation rs then
    match hidden with
    | [] =>
        let n := length (hd [] last) in
        norm_inequality rho (if (length last <=? n)%nat then last else columns zero n last)
    | first :: later =>
        lmi zero add mul (-1, 0) (mul (1, 1) rho) (neg rho) (firstn (length first) t) first
          (List.combine (split (skipn (length first) t) later) later) last
    end
  else
    let n := inputs hidden last in
    let bent := bent_lmi zero add mul (1, 1) (-1, 0) (repeat (shift (-1) rho) n) (bent_of rs hidden t) last in
    if existsb is_grouped rs then sum add bent (pins zero add mul n (pins_of n rs hidden t)) else bent.
(** Every row as long as the stage before it has rows; the first stage takes n inputs. *)
Fixpoint shapes (n : nat) (hidden : list matrixD) (last : matrixD) : bool :=
  match hidden with
  | [] => forallb (fun row => length row =? n)%nat last
  | m :: hidden' => forallb (fun row => length row =? n)%nat m && shapes (length m) hidden' last
  end.
(** Accepts |f(x) - f(x')| <= upper |x - x'| of the chain with these stages. *)
Definition check (rs : list relationD) (hidden : list matrixD) (last : matrixD) (upper rho : dyadic)
    (t : list dyadic) (f : factor) : bool :=
  shapes (inputs hidden last) hidden last && groups_fit rs hidden &&
  ((length t =? multipliers_needed rs hidden)%nat && forallb is_nonnegative t && is_positive rho && is_nonnegative upper
  && is_nonnegative (add (mul upper upper) (neg rho))
  && shows_nonnegative (matrix_inequality rs hidden last rho t) f).

(** Meaning *)
Open Scope R_scope.
Definition real (x : dyadic) : R := IZR (fst x) * powerRZ 2 (snd x).
#[global] Arguments real : simpl never.
Notation reals := (map real).
Notation realm := (map (map real)).

Lemma two_neq : 2 <> 0. Proof. lra. Qed.
Lemma power_pos e : 0 < powerRZ 2 e. Proof. apply powerRZ_lt. lra. Qed.
Lemma real_shiftl a n e : (0 <= n)%Z -> real (Z.shiftl a n, e) = real (a, n + e)%Z.
Proof.
  intros H. unfold real. simpl. rewrite Z.shiftl_mul_pow2, mult_IZR, powerRZ_add by (auto using two_neq).
  rewrite <- (Z2Nat.id n) at 1 by auto. rewrite <- pow_IZR, <- (Z2Nat.id n) at 1 by auto.
  rewrite pow_powerRZ, !Z2Nat.id by lia. ring.
Qed.
Lemma real_same a b e : real (a + b, e)%Z = real (a, e) + real (b, e).
Proof. unfold real. simpl. rewrite plus_IZR. ring. Qed.
Lemma real_zero : real zero = 0. Proof. unfold real. simpl. ring. Qed.
Lemma real_add x y : real (add x y) = real x + real y.
Proof.
  destruct x as [a e], y as [b f]. unfold add.
  destruct (Z.eqb_spec a 0) as [->|_]; [unfold real; simpl; ring|].
  destruct (Z.eqb_spec b 0) as [->|_]; [unfold real; simpl; ring|].
  destruct (Z.leb_spec e f); rewrite real_same, real_shiftl by lia; do 2 f_equal; f_equal; lia.
Qed.
Lemma real_mul x y : real (mul x y) = real x * real y.
Proof. unfold real, mul. simpl. rewrite mult_IZR, powerRZ_add by apply two_neq. ring. Qed.
Lemma real_neg x : real (neg x) = - real x.
Proof. unfold real, neg. simpl. rewrite opp_IZR. ring. Qed.
Lemma real_abs x : real (abs x) = Rabs (real x).
Proof.
  unfold real, abs. simpl. rewrite abs_IZR, Rabs_mult. f_equal. symmetry. apply Rabs_pos_eq. left. apply power_pos.
Qed.
Lemma real_shift k x : real (shift k x) = powerRZ 2 k * real x.
Proof. unfold real, shift. simpl. rewrite powerRZ_add by apply two_neq. ring. Qed.
Lemma real_nonnegative x : is_nonnegative x = true -> 0 <= real x.
Proof.
  unfold is_nonnegative, real. intros H. apply Rmult_le_pos; [|left;
    apply power_pos]. apply IZR_le. now apply Z.leb_le.
Qed.
Lemma real_positive x : is_positive x = true -> 0 < real x.
Proof.
  unfold is_positive, real. intros H. apply Rmult_lt_0_compat; [|apply power_pos]. apply IZR_lt. now apply Z.ltb_lt.
Qed.

Lemma off_diagonal a row z :
  - (a * a) * real (total (map abs row)) <= 2 * a * dotR (reals row) z + dotR (reals (map abs row)) (timesR z z).
Proof.
  revert z. induction row as [|r row IH]; intros z; simpl.
  - rewrite real_zero. lra.
  - rewrite real_add, real_abs. specialize (IH (tl z)). pose proof (Rabs_pos (real r)).
    assert (forall b, 0 <= (a * a + b * b) * Rabs (real r) + 2 * a * b * real r) as K.
    { intros b. destruct (Rle_dec 0 (real r)) as [G|G].
      - rewrite Rabs_pos_eq by auto. pose proof (Rmult_le_pos _ _ (Rle_0_sqr (a + b)) G). unfold Rsqr in *. nra.
      - rewrite Rabs_left by lra. assert (0 <= - real r) as G' by lra.
        pose proof (Rmult_le_pos _ _ (Rle_0_sqr (a - b)) G'). unfold Rsqr in *. nra. }
    destruct z as [|b z]; simpl in *.
    + rewrite !dot_nil_r in IH. pose proof (Rmult_le_pos _ _ (Rle_0_sqr a) H). unfold Rsqr in *. nra.
    + specialize (K b). nra.
Qed.

Lemma dominant_form e debts z : dominant e debts = true -> dotR (reals debts) (timesR z z) <= form (realm e) z.
Proof.
  revert debts z. induction e as [|row e IH]; intros debts z; simpl.
  - destruct debts; simpl; [lra|discriminate].
  - intros H. apply andb_prop in H. destruct H as [H1 H2]. apply real_nonnegative in H1.
    rewrite real_add, real_neg, real_add in H1.
    destruct z as [|a z]; [rewrite dot_nil_r; simpl; lra|].
    specialize (IH _ z H2). rewrite (f_plus add Rplus real real_add), dot_plus_l in IH.
    pose proof (off_diagonal a (tl row) z) as O.
    assert (hd 0 (reals row) = real (hd zero row)) as -> by (destruct row; simpl; auto using eq_sym, real_zero).
    assert (tl (reals row) = reals (tl row)) as -> by (destruct row; reflexivity).
    assert (dotR (reals debts) (timesR (a :: z) (a :: z)) =
        real (hd zero debts) * (a * a) + dotR (reals (tl debts)) (timesR z z)) as ->.
    { destruct debts; simpl; [rewrite real_zero|]; ring. }
    assert (0 <= a * a * (real (hd zero row) + - (real (hd zero debts) + real (total (map abs (tl row)))))) by nra.
    nra.
Qed.

Fixpoint scaled (s : list Z) (z : list R) : list R :=
  match z with [] => [] | a :: z' => powerRZ 2 (hd 0%Z s) * a :: scaled (tl s) z' end.
Lemma scaled_onto s z : exists y, scaled s y = z.
Proof.
  revert s. induction z as [|a z IH]; intros s; [now exists []|]. destruct (IH (tl s)) as [y Hy].
  exists (/ powerRZ 2 (hd 0%Z s) * a :: y). simpl. rewrite Hy. f_equal. field. apply powerRZ_NOR. lra.
Qed.
Lemma form_congruence s p z : form (realm (congruence s p)) z = form (realm p) (scaled s z).
Proof.
  revert s z. induction p as [|row p IH]; intros s [|a z]; simpl; auto. rewrite IH.
  assert (forall k s r y, dotR (reals (shift_row k s r)) y = powerRZ 2 k * dotR (reals r) (scaled s y)) as E.
  { clear. intros k s r. revert s. induction r as [|x r IH]; intros s [|b y]; simpl; try ring.
    rewrite IH, real_shift, powerRZ_add by apply two_neq. ring. }
  destruct row as [|x row]; simpl; [ring|]. rewrite E, real_shift, powerRZ_add by apply two_neq. ring.
Qed.

Lemma real_gram m : realm (gramD m) = gramR (realm m).
Proof.
  unfold gramD. set (e := lowest m). match goal with |- context [if ?c then _ else _] => destruct c eqn:E end.
  2:{ apply (f_gram zero add mul 0 Rplus Rmult real real_zero real_add real_mul). }
  assert (map (map IZR) (map (map (in_units e)) m) = scale_allR (powerRZ 2 (- e)) (realm m)) as U.
  { rewrite forallb_forall in E. unfold scale_all, scale. rewrite !map_map. apply map_ext_in. intros row Hr.
    rewrite !map_map. apply map_ext_in. intros [a k] Hx. specialize (E row Hr). rewrite forallb_forall in E.
    specialize (E _ Hx). apply Z.leb_le in E. cbn [snd] in E. unfold in_units. cbn [fst snd].
    pose proof (real_shiftl a (k - e) 0 ltac:(lia)) as S. unfold real in S |- *. cbn [fst snd] in *.
      simpl (powerRZ 2 0) in S.
    rewrite Z.add_0_r, Rmult_1_r in S. rewrite S. unfold Z.sub. rewrite powerRZ_add by apply two_neq. ring. }
  rewrite gramZ_gram. set (g := gram 0%Z Z.add Z.mul _).
  assert (realm (map (map (fun x => (x, (2 * e)%Z))) g) = scale_allR (powerRZ 2 (2 * e)) (map (map IZR) g)) as ->.
  { unfold scale_all, scale. rewrite !map_map. apply map_ext. intros r. rewrite !map_map. apply map_ext.
    intros x. unfold real. cbn [fst snd]. ring. }
  unfold g. rewrite (f_gram 0%Z Z.add Z.mul 0 Rplus Rmult IZR eq_refl plus_IZR mult_IZR), U.
  assert (forall c u v, dotR (scaleR c u) (scaleR c v) = c * c * dotR u v) as D
    by (intros; rewrite dot_scale_l, dot_scale_r; ring).
  assert (powerRZ 2 (2 * e) * (powerRZ 2 (- e) * powerRZ 2 (- e)) = 1) as P.
  { rewrite <- !powerRZ_add by apply two_neq. replace (2 * e + (- e + - e))%Z with 0%Z by lia. reflexivity. }
  clear -D P. generalize (realm m). intros rows. unfold scale_all, scale. induction rows as [|r rows IH]; auto.
  assert (forall u v, powerRZ 2 (2 * e) * dotR (scaleR (powerRZ 2 (- e)) u) (scaleR (powerRZ 2 (- e)) v) = dotR u
    v) as F
    by (intros u v; rewrite D, <- Rmult_assoc, P; ring).
  cbn [map gram]. rewrite IH. f_equal. f_equal; [apply F|]. rewrite !map_map. apply map_ext. intros v. apply F.
Qed.
Lemma real_norm_inequality rho m :
  realm (norm_inequality rho m) = norm_lmi 0 Rplus Rmult (-1) (real rho) (realm m).
Proof.
  unfold norm_inequality, norm_lmi.
  rewrite (f_sum add Rplus real real_add), (f_diagonal zero 0 real real_zero),
    (f_scale_all mul Rmult real real_mul), real_gram.
  rewrite !map_map. replace (real (-1, 0)%Z) with (-1) by (unfold real; simpl; ring). reflexivity.
Qed.

(** (a) *)
Theorem shows_nonnegative_sound p f : shows_nonnegative p f = true -> nonnegative (realm p).
Proof.
  intros H w. destruct (scaled_onto (scales f) w) as [z <-].
  apply (dominant_form _ [] z) in H. change (0 <= form (realm (remainder p f)) z) in H. unfold remainder in H.
  rewrite (f_sum add Rplus real real_add), form_sum, form_congruence in H.
  rewrite gramZ_gram in H. set (g := gram 0%Z Z.add Z.mul (rows f)) in H.
  assert (realm (map (map (fun g => ((- g)%Z, (2 * unit f)%Z))) g) =
      scale_allR (- powerRZ 2 (2 * unit f)) (map (map IZR) g)) as E.
  { unfold scale_all, scale. rewrite !map_map. apply map_ext. intros r. rewrite !map_map. apply map_ext.
    intros x. unfold real. cbn [fst snd]. rewrite opp_IZR. ring. }
  rewrite E, form_scale in H. unfold g in H.
  rewrite (f_gram 0%Z Z.add Z.mul 0 Rplus Rmult IZR eq_refl plus_IZR mult_IZR), form_gram in H.
  pose proof (Rmult_le_pos _ _ (Rlt_le _ _ (power_pos (2 * unit f)))
      (square_nonneg (combine_rows z (map (map IZR) (rows f))))).
  lra.
Qed.

Lemma split_fits t ms : length t = neurons ms -> Forall (fun x => is_nonnegative x = true) t ->
  Forall2 fits (map realm ms) (map reals (split t ms)).
Proof.
  revert t. induction ms as [|m ms IH]; intros t H Ht; simpl in *; constructor.
  - split.
    + rewrite !map_length, firstn_length. lia.
    + apply Forall_map. rewrite <- (firstn_skipn (length m) t) in Ht. apply Forall_app in Ht.
      eapply Forall_impl; [|apply Ht]. intros. now apply real_nonnegative.
  - apply IH; [rewrite skipn_length; lia|]. rewrite <- (firstn_skipn (length m) t) in Ht. now apply Forall_app in Ht.
Qed.

(** A network with these matrices, any biases and any functions that keep the number of numbers. *)
Definition stack := (list matrixD * matrixD)%type.
Definition real_stack := (list ((list R -> list R) * layer) * layer)%type.
Definition run (l : real_stack) : list R -> list R := network (fst l) (snd l).
Definition of_matrix (m : matrixD) (l : layer) := fst l = realm m /\ length (snd l) = length m.
Definition keeps_length (f : list R -> list R) := forall y, length (f y) = length y.
Definition of_stage (m : matrixD) (k : (list R -> list R) * layer) := of_matrix m (snd k) /\ keeps_length (fst k).
Definition instance (p : stack) (l : real_stack) := Forall2 of_stage (fst p) (fst l) /\ of_matrix (snd p) (snd l).
Definition real_range (r : rangeD) : range := (real (fst r), real (snd r)).
Definition real_relation (r : relationD) : relation R :=
  match r with Each ranges => Each (map real_range ranges) | Grouped n k => Grouped n k end.
Definition real_relations : list relationD -> list (relation R) := map real_relation.

Lemma matrix_fits m l : of_matrix m l -> bias_fits l.
Proof. intros [E H]. unfold bias_fits. now rewrite E, map_length. Qed.
Lemma stages_fit ms ks : Forall2 of_stage ms ks ->
  Forall (fun k => bias_fits (snd k)) ks /\ map weights ks = map realm ms /\ Forall (fun k => keeps_length (fst k)) ks.
Proof.
  intros H. induction H as [|m k ms ks [H K] Hs (IH1 & IH2 & IH3)]; simpl; repeat split; auto.
  - constructor; auto. eapply matrix_fits; eauto.
  - f_equal; auto. apply H.
Qed.
Lemma is_zero_real x : is_zero x = true -> real x = 0.
Proof. unfold is_zero, real. intros H. apply Z.eqb_eq in H. rewrite H. ring. Qed.
Lemma unit_relations rs : forallb is_unit_relation rs = true -> Forall unit_relation (real_relations rs).
Proof.
  unfold real_relations. intros H. rewrite forallb_forall in H. apply Forall_map, Forall_forall. intros r Hr.
  specialize (H r Hr). destruct r as [ranges|n k]; [|discriminate]. cbn in *. rewrite forallb_forall in H.
  apply Forall_map, Forall_forall. intros [a b] Hi.
  apply H, andb_prop in Hi. destruct Hi as [Ha Hb]. apply is_zero_real in Ha, Hb. cbn [fst snd] in *.
  rewrite real_add in Hb. replace (real (-1, 0)%Z) with (-1) in Hb by (unfold real; simpl; ring).
  unfold unit_range, real_range. cbn [fst snd]. f_equal; lra.
Qed.
Lemma unit_needs rs ms : forallb is_unit_relation rs = true -> multipliers_needed rs ms = neurons ms.
Proof.
  revert ms. induction rs as [|r rs IH]; intros ms H.
  - clear H. induction ms as [|m ms IH]; simpl in *; auto.
  - apply andb_prop in H. destruct H as [Hr H]. destruct ms as [|m ms]; auto. simpl. rewrite IH by auto.
    now destruct r.
Qed.
Lemma real_minus_one : real minus_one = -1. Proof. unfold real, minus_one. simpl. ring. Qed.
Lemma real_spread k t : reals (spread k t) = spread k (reals t).
Proof.
  unfold spread. induction t as [|a t IH]; simpl; auto. rewrite map_app, IH. f_equal. clear.
  induction k; simpl; congruence.
Qed.
Lemma nonnegative_firstn n t : Forall (fun x => is_nonnegative x = true) t -> Forall (Rle 0) (reals (firstn n t)).
Proof.
  intros H. apply Forall_map. rewrite <- (firstn_skipn n t) in H. apply Forall_app in H.
  eapply Forall_impl; [|apply H]. intros. now apply real_nonnegative.
Qed.
Lemma stages_bent rs ms ks t h h' : along ks (real_relations rs) h h' -> Forall2 of_stage ms ks ->
  groups_fit rs ms = true -> length t = multipliers_needed rs ms -> Forall (fun x => is_nonnegative x = true) t ->
  let bs := images real (bent_of rs ms t) in Forall2 bent_as ks bs /\ Forall2 covers (real_relations rs) bs.
Proof.
  simpl. intros A M. revert rs t h h' A.
  induction M as [|m [f [m' c]] ms ks Hm Hms IH]; intros [|r rs] t h h' A G L N; simpl in A; try contradiction;
    [split; constructor|].
  destruct A as [_ A]. destruct Hm as [Hm _]. pose proof (matrix_fits _ _ Hm) as B. destruct Hm as [Em _].
  cbn [fst snd] in *. subst m'.
  assert (groups_fit rs ms = true) as G' by (destruct r; cbn in G; [|apply andb_prop in G]; tauto).
  simpl in L. destruct (IH rs (skipn (multipliers_in r m) t) _ _ A G') as [I J].
  - rewrite skipn_length. lia.
  - rewrite <- (firstn_skipn (multipliers_in r m) t) in N. now apply Forall_app in N.
  - cbn [bent_of images map real_relations]. split; constructor; auto; destruct r as [ranges|n k];
      cbn [multipliers_in] in L; unfold bent_as, fits, weights, multipliers_of, ranges_of; cbn [fst snd covers].
    + repeat split; auto; [|now apply nonnegative_firstn]. rewrite !map_length, firstn_length. lia.
    + cbn in G. apply andb_prop in G. destruct G as [G _]. apply Nat.eqb_eq in G. rewrite real_spread.
      repeat split; auto; [|now apply spread_nonnegative, nonnegative_firstn].
      rewrite length_spread, !map_length, firstn_length, Nat.min_l by lia. congruence.
    + reflexivity.
    + split.
      * unfold image_of_ranges, ranges_of. cbn [fst snd]. generalize (n * k)%nat as i. intros i.
        induction i as [|i IHi]; simpl; auto. rewrite IHi, real_minus_one. repeat f_equal.
        unfold real. simpl. ring.
      * exists (reals (firstn n t)). unfold multipliers_of. cbn [fst snd]. rewrite real_spread. repeat split.
        -- rewrite map_length, firstn_length. lia.
        -- now apply nonnegative_firstn.
Qed.
Lemma stages_pinned rs ms ks t n h h' : along ks (real_relations rs) h h' -> Forall2 of_stage ms ks ->
  groups_fit rs ms = true -> length h = n -> length h' = n ->
  pinned ks (images_of_pins real (pins_of n rs ms t)) h h'.
Proof.
  intros A M. revert rs t n h h' A.
  induction M as [|m [f [m' c]] ms ks Hm Hms IH]; intros [|r rs] t n h h' A G L L'; simpl in A; try contradiction;
    [exact Logic.I|].
  destruct A as [Hf A]. destruct Hm as [Hm _]. pose proof (matrix_fits _ _ Hm) as B. destruct Hm as [Em Hc].
  cbn [fst snd] in *. subst m'. unfold bias_fits in B. cbn [fst snd] in B.
  assert (groups_fit rs ms = true) as G' by (destruct r; cbn in G; [|apply andb_prop in G]; tauto).
  destruct (related_lengths _ _ _ _ _ Hf) as (_ & Lz & Lz').
  rewrite length_affine, map_length in Lz, Lz' by auto.
  specialize (IH rs (skipn (multipliers_in r m) t) (length m) _ _ A G' Lz Lz').
  cbn [pins_of images_of_pins map pinned]. destruct r as [ranges|g k]; cbn [fst snd map]; repeat split; auto.
  rewrite (f_sum_rows zero add 0 Rplus real real_zero real_add), real_minus_one.
  assert (length (minus h h') = n) as Ld by (rewrite length_minus; congruence). rewrite <- Ld.
  apply (sum_rows_vanish g k (realm m) (minus h h') []). destruct Hf as [_ Hf]. now rewrite minus_affine in Hf by auto.
Qed.

Lemma norm_bound upper rho f x x' : 0 <= upper -> rho <= upper * upper ->
  square (minus (f x) (f x')) <= rho * square (minus x x') -> norm (minus (f x) (f x')) <= upper * norm (minus x x').
Proof.
  intros Hu Hr H. unfold norm. rewrite <- (sqrt_square upper) at 1 by auto. rewrite <- sqrt_mult_alt by nra.
  apply sqrt_le_1_alt. pose proof (square_nonneg (minus x x')). nra.
Qed.

(** (d) *)
Theorem check_sound rs hidden last upper rho t f : check rs hidden last upper rho t f = true ->
  forall l, instance (hidden, last) l ->
  forall x x', length x = inputs hidden last -> length x' = inputs hidden last ->
  along (fst l) (real_relations rs) x x' ->
  norm (minus (run l x) (run l x')) <= real upper * norm (minus x x').
Proof.
  unfold check. intros H [ks [last' b]] [Hks Hb] x x' Hx Hx' A. simpl in Hks, Hb, A.
  apply andb_prop in H. destruct H as [G H]. apply andb_prop in G. destruct G as [_ G].
    repeat (apply andb_prop in H; destruct H as [H ?]).
  apply Nat.eqb_eq in H. rename H into Hn, H0 into HP, H1 into Hur, H2 into Hu, H3 into Hrho, H4 into Ht.
  apply shows_nonnegative_sound in HP. apply real_nonnegative in Hu, Hur. apply real_positive in Hrho.
  rewrite real_add, real_mul, real_neg in Hur.
  pose proof (matrix_fits _ _ Hb) as Hl. destruct Hb as [E Hb]. simpl in E. subst last'.
  apply (norm_bound (real upper) (real rho) (run (ks, (realm last, b)))); [auto|lra|]. unfold run. simpl.
  assert (real (-1, 0)%Z = -1) as M by (unfold real; simpl; ring).
  rewrite forallb_forall, <- Forall_forall in Ht. unfold matrix_inequality in HP. destruct (forallb _ rs) eqn:Z.
  - rewrite (unit_needs _ _ Z) in Hn. pose proof (split_fits t hidden Hn Ht) as F.
    destruct (stages_fit _ _ Hks) as (B & W & _). apply unit_relations in Z.
    destruct Hks as [|first [g [m c]] later ks [[E Hc] _] Hks]; simpl in HP.
    + rewrite real_norm_inequality in HP.
      destruct (length last <=? _)%nat.
      * now apply norm_lmi_bounds.
      * rewrite (f_columns zero 0 real real_zero) in HP. eapply norm_lmi_columns_bounds; eauto.
    + simpl in E, Hc. subst m. inversion B; subst. inversion W as [W']. inversion F; subst.
      rewrite (f_lmi zero add mul 0 Rplus Rmult real real_zero real_add real_mul), M, real_mul, real_neg in HP.
      replace (real (1, 1)%Z) with 2 in HP by (unfold real; simpl; ring).
      destruct rs as [|r rs]; [contradiction|].
      apply lmi_bounds with (r := real_relation r) (ranges := real_relations rs)
        (t := reals (firstn (length first) t)) (ts := map reals (split (skipn (length first) t) later)); auto.
      * now rewrite W'.
      * rewrite W'. assert (forall ts (ms : list matrixD), pairs real (List.combine ts ms) =
          List.combine (map reals ts) (map realm ms)) as Q.
        { clear. induction ts as [|u ts IH]; intros [|m ms]; simpl; auto. now rewrite IH. }
        now rewrite Q in HP.
  - cbv zeta in HP. set (n := inputs hidden last) in *.
    assert (forall p : matrixD, p = bent_lmi zero add mul (1, 1)%Z (-1, 0)%Z (repeat (shift (-1) rho) n)
      (bent_of rs hidden t) last -> realm p = bent_lmiR 2 (-1) (repeat (real rho / 2) n)
      (images real (bent_of rs hidden t)) (realm last)) as Q.
    { intros p ->. rewrite (f_bent_lmi zero add mul 0 Rplus Rmult real real_zero real_add real_mul), M.
      replace (real (1, 1)%Z) with 2 by (unfold real; simpl; ring). f_equal.
      clear. induction n as [|n IH]; simpl; auto. rewrite IH, real_shift. f_equal. simpl. field. }
    destruct (stages_bent _ _ _ _ _ _ A Hks G Hn Ht) as [B C].
    destruct (existsb is_grouped rs).
    + rewrite (f_sum add Rplus real real_add), (Q _ eq_refl),
        (f_pins zero add mul 0 Rplus Rmult real real_zero real_add real_mul) in HP.
      eapply pinned_lmi_bounds; eauto. now apply stages_pinned.
    + rewrite (Q _ eq_refl) in HP. eapply bent_lmi_bounds; eauto.
Qed.
